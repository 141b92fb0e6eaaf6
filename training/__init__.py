"""Programs that train the networks which ship with hairkit; not part of the installed package.

* `hair_depth`: the network of `hairkit.field.hair_depth`
* `hair_network`: the network of the plugin `auto_matte`
"""
