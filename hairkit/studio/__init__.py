"""The studio: a server on this machine and its pages, from a camera to moving hair.

Pages are static files in `pages/`; they ask the routes below `/api`. What computes runs in
processes of its own, and all state is in the project's folder.

* `app`: pages, routes and guard as one server
* `capture_guides`: where the head should be in each picture of a turn
* `clean_photo`: photos without what their files tell of a person
* `downloads`: files of the hair, written when they are asked for
* `events`: what changed, sent to pages
* `feedback`: what is said about a photo, one list for all
* `framing`: whether the head is where the page draws it
* `guard`: who may ask for what
* `hair_packet`: a groom as the page reads it
* `lan`: addresses, certificate and code for a phone
* `photo_files`: which files are photos, and when one changed
* `photo_tasks`: those of these tasks that see one photo
* `pose`: the head in every photo
* `project`: the files of a project
* `result_page`: the hair in one file that needs no server
* `routes`: what pages ask
* `studio`: one project being worked on
* `task_child`: the program that does tasks, in that process
* `task_process`: a process for tasks, replaced when it dies
* `tasks`: what these processes do
* `uploads`: bodies of requests within limits
"""
