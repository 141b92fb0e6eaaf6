# The JSON of a .glb file, read by Godot 3.
extends Object


static func read(path):
	var file = File.new()
	if file.open(path, File.READ) != OK:
		push_error("%s cannot be read" % path)
		return {}
	file.seek(12)
	var size = file.get_32()
	file.get_32()
	return parse_json(file.get_buffer(size).get_string_from_utf8())
