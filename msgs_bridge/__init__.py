"""
Between ROS and the core: messages, what every node shares, files and text from elsewhere.

`messages` turns messages into the core's types and back, `sensing` scans and costmaps into local
grids, `node` is what every node's main and logs are made of, `teaching` what keys and page share,
`untrusted` opens files and prints text that are not ours. Every package above may come in; nothing
here knows a bag.
"""
