"""From photos to a groom: recipes, stages, the work folder and what a run leaves.

The program that runs the plugins of a recipe. No method of reconstruction is here: those are
plugins.

* `contact_sheet`: one picture of all stages
* `draft`: a quick groom after a change by hand
* `figure`: a figure of the health of a run, and its light
* `find_views`: faces, persons, and from where each photo was taken
* `drawn_hair`: guides against the photos themselves
* `findings`: the walk through the stages
* `found`: properties that are made once
* `head_alone`: the head with its skin, without hair
* `health`: figures that tell how good a run is
* `judge_turn`: arrangements of the photos judged by their cameras
* `module_digest`: digests of the code that made a cached result
* `open_groom`: grooms by any name that a user may give
* `own_head`: landmarks for a head that has none
* `plugin_lock`: versions of plugins that a recipe is run with
* `recipe`: which plugin does each stage, with which options
* `reconstruct`: a whole run
* `rerun`: a run once more, from its record
* `run_log`: `hairkit.log`: versions, options and times
* `run_record`: `run.json`: inputs, recipe, outputs and health
* `single_photo`: what a photo shows before the whole turn is there
* `stage_runner`: one stage, once or once for each view
* `take_capture`: the stage that reads the photos
* `work_folder`: cached results of stages
"""
