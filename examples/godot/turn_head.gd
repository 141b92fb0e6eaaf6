# Turns the avatar's head to and fro, so that its hair swings. The same lines run in Godot 3.2 and 4.
extends Node

const FILE = "res://avatar.glb"
const WIDEST = 0.7  # radians
const SPEED = 4.0  # radians of the swing's phase in a second

var skeleton
var springs
var head
var upright
var seconds = 0.0


func _ready():
	skeleton = _find_skeleton(get_node("avatar"))
	head = skeleton.find_bone("head")
	upright = skeleton.get_bone_global_pose(head)
	springs = load("res://hair_springs.gd").new()
	springs.start(skeleton, FILE)
	springs.set_physics_process(false)  # the head turns first, then its hair
	add_child(springs)


func _physics_process(passed):
	seconds += passed
	turn(WIDEST * sin(SPEED * seconds), passed)


func turn(angle, passed):
	var pose = upright
	pose.basis = Basis(Vector3(0, 1, 0), angle) * upright.basis
	skeleton.set_bone_global_pose_override(head, pose, 1.0, true)
	springs.step(passed)


func _find_skeleton(node):
	if node.get_class() in ["Skeleton", "Skeleton3D"]:
		return node
	for child in node.get_children():
		var found = _find_skeleton(child)
		if found != null:
			return found
	return null
