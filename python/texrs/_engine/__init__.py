"""The calls of the engine that grows by corrected coordinates: fixed-point coordinates, packed windows. Private."""
