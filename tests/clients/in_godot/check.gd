# Turns the head of the example's scene as `frames.mjs` does, tells where bones are, takes a picture.
extends "res://turn_head.gd"


func _ready():
	set_physics_process(false)
	var told = {"bones": skeleton.get_bone_count(), "before": _bones()}
	for number in range(30):
		turn(0.02 * number, 1.0 / 60.0)
	told["after"] = _bones()
	var file = File.new()
	file.open("res://told.json", File.WRITE)
	file.store_string(to_json(told))
	file.close()
	for _frame in range(2):
		yield(VisualServer, "frame_post_draw")
	var picture = get_viewport().get_texture().get_data()
	picture.flip_y()
	picture.save_png("res://seen.png")
	get_tree().quit()


func _bones():
	var places = {}
	for bone in range(skeleton.get_bone_count()):
		var place = skeleton.global_transform * skeleton.get_bone_global_pose(bone).origin
		places[skeleton.get_bone_name(bone)] = [place.x, place.y, place.z]
	return places
