"""
From what sensors say to the 3x3 neighbourhood: geometry, with poses passed in.

Comes in: `neighbourhood_node` for a live robot, `episode_store.external` for a recorded one.
"""
