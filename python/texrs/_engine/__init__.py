"""Private calls of the engine that grows textures by corrected coordinates: fixed-point coordinates, packed windows."""
