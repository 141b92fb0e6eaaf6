# Swings the hair of a .vrm file that hairkit wrote, by the rules of VRMC_springBone 1.0.
#
# Godot imports a .vrm file under the name .glb, with its skeleton and skin but without its springs.
# This node reads the springs from the file and moves the bones of the skeleton at each physics
# frame. The same lines run in Godot 3.2 and 4. An exported game must hold the .glb file itself: add
# "*.glb" to the filters of its export.
extends Node

var skeleton  # Skeleton (Godot 3) or Skeleton3D (Godot 4)
var chains = []  # each a list of joints: bone, axis to the next, stiffness, drag, radius, tails
var capsules = []  # each: bone, two ends in its space, radius


func start(of_skeleton, path):
	skeleton = of_skeleton
	var reader = load("res://glb_json_%d.gd" % Engine.get_version_info()["major"])
	var document = reader.read(path)
	var springs = document["extensions"]["VRMC_springBone"]
	capsules = _read_capsules(document["nodes"], springs)
	chains = []
	for spring in springs["springs"]:
		chains.append(_read_chain(document["nodes"], spring["joints"]))
	reset()


# Hair as the head carries it, at rest.
func reset():
	for chain in chains:
		var pose = skeleton.get_bone_global_pose(chain[0]["parent"])
		for joint in chain:
			pose = pose * skeleton.get_bone_rest(joint["bone"])
			joint["tail"] = _place() * (pose * joint["axis"])
			joint["before"] = joint["tail"]


func _physics_process(seconds):
	step(seconds)


func step(seconds):
	var shapes = _placed_capsules()
	for chain in chains:
		var pose = skeleton.get_bone_global_pose(chain[0]["parent"])
		for joint in chain:
			pose = pose * skeleton.get_bone_rest(joint["bone"])
			pose = _swung(joint, pose, seconds, shapes)
			skeleton.set_bone_global_pose_override(joint["bone"], pose, 1.0, true)


# The pose of a joint, turned to where its tail has moved; the tail keeps its distance.
func _swung(joint, pose, seconds, shapes):
	var world = _place() * pose
	var length = joint["axis"].length()
	var rest = (world.basis * joint["axis"]).normalized()
	var inertia = (joint["tail"] - joint["before"]) * (1.0 - joint["drag"])
	var pull = rest * joint["stiffness"] + joint["gravity"]
	var tail = joint["tail"] + inertia + pull * seconds
	tail = world.origin + (tail - world.origin).normalized() * length
	for shape in shapes:
		var push = _outside(shape, tail, joint["radius"])
		tail = world.origin + (push - world.origin).normalized() * length
	joint["before"] = joint["tail"]
	joint["tail"] = tail
	var inside = _place().basis.inverse()
	var from = (inside * rest).normalized()
	var to = (inside * (tail - world.origin)).normalized()
	var axis = from.cross(to)
	if axis.length() > 0.000001:
		pose.basis = Basis(axis.normalized(), from.angle_to(to)) * pose.basis
	return pose


func _outside(shape, point, radius):
	var along = shape["to"] - shape["from"]
	var share = (point - shape["from"]).dot(along) / max(along.dot(along), 0.0000000001)
	var nearest = shape["from"] + along * clamp(share, 0.0, 1.0)
	var apart = point - nearest
	var least = shape["radius"] + radius
	return point if apart.length() >= least else nearest + apart.normalized() * least


func _placed_capsules():
	var placed = []
	for capsule in capsules:
		var pose = _place() * skeleton.get_bone_global_pose(capsule["bone"])
		placed.append({
			"from": pose * capsule["from"], "to": pose * capsule["to"], "radius": capsule["radius"]
		})
	return placed


func _place():
	return skeleton.global_transform


func _read_chain(nodes, joints):
	var chain = []
	for number in range(len(joints) - 1):  # the last is the tip of the one before
		var joint = joints[number]
		var bone = skeleton.find_bone(nodes[int(joint["node"])]["name"])
		var next = skeleton.find_bone(nodes[int(joints[number + 1]["node"])]["name"])
		chain.append({
			"bone": bone,
			"parent": skeleton.get_bone_parent(bone),
			"axis": skeleton.get_bone_rest(next).origin,
			"stiffness": joint["stiffness"],
			"drag": joint["dragForce"],
			"gravity": _vector(joint["gravityDir"]) * joint["gravityPower"],
			"radius": joint["hitRadius"],
		})
	return chain


func _read_capsules(nodes, springs):
	var found = []
	for collider in springs["colliders"]:
		var shape = collider["shape"]["capsule"]
		found.append({
			"bone": skeleton.find_bone(nodes[int(collider["node"])]["name"]),
			"from": _vector(shape["offset"]),
			"to": _vector(shape["tail"]),
			"radius": shape["radius"],
		})
	return found


func _vector(numbers):
	return Vector3(numbers[0], numbers[1], numbers[2])
