"""
From what sensors say to the local grid: geometry, with poses passed in.

Comes in: `neighbourhood_node` for a live robot, `episode_store.external` for a recorded one.
"""
