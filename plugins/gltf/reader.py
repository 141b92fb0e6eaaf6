def read_gltf_groom(path, options):
    raise NotImplementedError
