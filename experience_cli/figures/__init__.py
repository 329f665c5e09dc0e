"""Pictures with matplotlib: fields, maps, paths, learning."""
