# The JSON of a .glb file, read by Godot 4.
extends Object


static func read(path):
	var file = FileAccess.open(path, FileAccess.READ)
	if file == null:
		push_error("%s cannot be read" % path)
		return {}
	file.seek(12)
	var size = file.get_32()
	file.get_32()
	return JSON.parse_string(file.get_buffer(size).get_string_from_utf8())
