"""Many captures: each one a job in a process of its own, on this machine or on Dask's workers.

A capture that fails, hangs, crashes or eats memory fails alone. What is done is on disk, one folder
a capture, so that the next run does only what is missing.

* `batch`: `batch`, the function behind `hairkit batch`
* `capture_child`: the process that reconstructs one capture after the other
* `dask_pool`: jobs on Dask
* `farm_files`: job files for render farms and shells
* `jobs`: captures to be done, their settings and their results
* `pool`: jobs on this machine, with its memory counted
* `report`: the page and the JSON file about a batch
* `run_job`: one job with its limits and tries
"""
