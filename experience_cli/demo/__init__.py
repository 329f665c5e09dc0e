"""Teaching and trying on real nodes: processes, the client node, the report."""
