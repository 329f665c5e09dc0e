"""
The command line ``experience``.

A module a command in `commands`, imported when it is called; `demo` runs real nodes, `figures`
draws. On top lies what commands share: `main`, how a bag is named, how a file is written, Ctrl-C.
"""
