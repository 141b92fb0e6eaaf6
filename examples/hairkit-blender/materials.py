"""Materials in the captured colour."""

import bpy

ROUGHNESS = 0.3
DARKENING = 1.8
"""Exponent of the captured colour on its way into the fibre. The captured colour is what the hair
looks like in photos; the model's colour is that of very dense hair and comes out much paler. Found
by eye, so that dark hair looks as in hairkit's own picture."""
HEAD_COLOUR = (0.45, 0.27, 0.2, 1.0)


COLOUR = "colour"
"""Attribute of points with a colour of their own."""


def hair_material(root_colour, tip_colour):
    """Return a hair material (Chiang et al. 2016) in colours of points, or from root to tip."""
    material = bpy.data.materials.new("hair")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    info = tree.nodes.new("ShaderNodeHairInfo")
    mix, own = (tree.nodes.new("ShaderNodeMix") for _ in range(2))
    given = tree.nodes.new("ShaderNodeAttribute")
    given.attribute_name = COLOUR
    gamma = tree.nodes.new("ShaderNodeGamma")
    fibre = tree.nodes.new("ShaderNodeBsdfHairPrincipled")
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    for index, node in enumerate((info, mix, given, own, gamma, fibre, output)):
        node.location.x = 250 * index
    for socket, colour in zip(_of(mix, "inputs"), (root_colour, tip_colour), strict=True):
        socket.default_value = (*map(float, colour), 1.0)
    fibre.parametrization = "COLOR"
    fibre.inputs["Roughness"].default_value = ROUGHNESS
    gamma.inputs["Gamma"].default_value = DARKENING
    ramp, other = _of(own, "inputs")
    tree.links.new(info.outputs["Intercept"], _of(mix, "inputs", "VALUE")[0])
    tree.links.new(_of(mix, "outputs")[0], ramp)
    tree.links.new(given.outputs["Color"], other)
    tree.links.new(given.outputs["Alpha"], _of(own, "inputs", "VALUE")[0])  # 0 without colours
    tree.links.new(_of(own, "outputs")[0], gamma.inputs["Color"])
    tree.links.new(gamma.outputs["Color"], fibre.inputs["Color"])
    tree.links.new(fibre.outputs[0], output.inputs["Surface"])
    material.diffuse_color = (*map(float, root_colour), 1.0)  # of the solid view
    return material


def _of(mix, side, kind="RGBA"):
    """Return the sockets of a mix of colours that are in use."""
    mix.data_type = "RGBA"
    return [socket for socket in getattr(mix, side) if socket.enabled and socket.type == kind]


def head_material():
    """Return a plain skin, shared by all heads."""
    name = "hairkit head"
    material = bpy.data.materials.get(name)
    if material is None:
        material = bpy.data.materials.new(name)
        material.use_nodes = True
        skin = material.node_tree.nodes["Principled BSDF"]
        skin.inputs["Base Color"].default_value = HEAD_COLOUR
        skin.inputs["Roughness"].default_value = 0.6
        material.diffuse_color = HEAD_COLOUR
    return material
