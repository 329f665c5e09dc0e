"""Pictures with matplotlib: fields, maps, paths, learning. Nothing else imports matplotlib."""
