#!/bin/sh
# Make .venv: the locked dependencies and this project, editable; with the argument `tools` also
# what testing and checking need. Does nothing when nothing changed. Called by `make setup` and
# `make tools`; PYTHON names the interpreter, VENV the folder.
set -eu

cd "$(dirname "$0")/.."
VENV="${VENV:-.venv}"
STAMP="$VENV/setup-stamp"
WANTED='Python 3.11 or 3.12'

die() {
    echo "setup: $*" >&2
    exit 2
}

# Run the candidate: a name on the PATH may be a shim that leads nowhere.
suits() {
    "$1" -c 'import sys; sys.exit(sys.version_info[:2] not in ((3, 11), (3, 12)))' \
        >/dev/null 2>&1
}

choose_python() {
    if [ -n "${PYTHON:-}" ]; then
        suits "$PYTHON" || die "PYTHON=$PYTHON is not a working $WANTED"
        return
    fi
    for PYTHON in python3.12 python3.11 python3; do
        if suits "$PYTHON"; then
            return
        fi
    done
    die "found no $WANTED; install one (Debian 12: 'apt install python3 python3-venv'," \
        "Ubuntu 24.04: the same) or name it: 'make PYTHON=/path/to/python3.12'"
}

# What the installed packages depend on: the locks and where the folder lies (scripts name it).
dependencies_key() {
    cat requirements-build.lock requirements.lock tools/setup.sh
    pwd -P
}

tools_key() {
    cat requirements-dev.lock
}

# Whether .venv still runs, and on the interpreter that was asked for, if one was.
fits() {
    which='import sys; print(sys.base_prefix, sys.version)'
    found=$("$VENV/bin/python" -c "$which" 2>/dev/null) || return 1
    [ -z "${PYTHON:-}" ] || [ "$found" = "$("$PYTHON" -c "$which" 2>/dev/null)" ]
}

# What the installation of this project depends on; its modules and its data stay in the tree.
project_key() {
    cat setup.py setup.cfg pyproject.toml experience_cli/quiet_start.py
}

key_of() {
    "$1" | cksum
}

# The stamps are written last and by a rename, so an interrupted installation has none.
stamp() {
    key_of "$1" >"$STAMP-$1.new"
    mv "$STAMP-$1.new" "$STAMP-$1"
}

stamped() {
    [ -f "$STAMP-$1" ] && [ "$(cat "$STAMP-$1")" = "$(key_of "$1")" ]
}

make_venv() {
    choose_python
    "$PYTHON" -c 'import ensurepip, venv' 2>/dev/null ||
        die "$PYTHON cannot make virtual environments; install them: 'apt install python3-venv'"
    echo "setup: making $VENV with $("$PYTHON" --version)"
    rm -rf "$VENV"
    "$PYTHON" -m venv "$VENV" || die "'$PYTHON -m venv $VENV' failed (see above);" \
        "on Debian and Ubuntu 'apt install python3-venv' usually helps"
}

pip() {
    "$VENV/bin/python" -m pip --disable-pip-version-check --no-input -q "$@"
}

install_builder() {
    echo 'setup: installing the locked dependencies'
    pip install --require-hashes -r requirements-build.lock ||
        die "could not install the builder (see above): is a Python package index reachable?"
}

install_lock() {
    # pip is the way out where only pip is set up for the index.
    UV_LINK_MODE=copy "$VENV/bin/uv" pip install -q --python "$VENV/bin/python" \
        --compile-bytecode --no-build-isolation --require-hashes -r "$1" ||
        pip install --no-build-isolation --require-hashes -r "$1" ||
        die "could not install the dependencies (see above)"
}

install_project() {
    echo 'setup: installing experience_controller'
    pip install --no-deps --no-build-isolation --editable . ||
        die 'could not install this project (see above)'
    # An editable installation leaves out data files; the ament index needs them.
    share="$VENV/share/experience_controller"
    rm -rf "$share"
    mkdir -p "$share"
    for name in package.xml launch config; do
        ln -s "$(pwd -P)/$name" "$share/$name"
    done
    ln -sf "$(pwd -P)/resource/experience_controller" \
        "$VENV/share/ament_index/resource_index/packages/experience_controller"
}

# Ctrl-C is heard from the first moment on: see experience_cli/quiet_start.py. Python imports what
# is named in the first .pth file before anything else; and until it does so, the signal waits.
start_quietly() {
    for packages in "$VENV"/lib/python3*/site-packages; do
        if [ -d "$packages" ]; then
            cat experience_cli/quiet_start.py >"$packages/_experience_quiet_start.py"
            echo 'import _experience_quiet_start' >"$packages/00_experience_quiet_start.pth"
        fi
    done
    if /usr/bin/env --block-signal=INT /bin/sh -c : 2>/dev/null; then
        for script in "$VENV/bin/experience" "$VENV"/bin/*_node; do
            if [ -f "$script" ]; then
                let_signals_wait "$script"
            fi
        done
    fi
}

let_signals_wait() {
    {
        read -r first
        case "$first" in
        '#!/usr/bin/env '*) ;;
        # A longer line would be cut off by old kernels.
        '#!'*python*) [ "${#first}" -gt 88 ] ||
            first="#!/usr/bin/env -S --block-signal=INT ${first#??}" ;;
        esac
        echo "$first"
        cat
    } <"$1" >"$1.new"
    cat "$1.new" >"$1"
    rm "$1.new"
}

if ! { stamped dependencies_key && fits; }; then
    make_venv
    install_builder
    install_lock requirements.lock
    stamp dependencies_key
fi
if ! stamped project_key; then
    rm -f "$STAMP-project_key"
    install_project
    start_quietly
    stamp project_key
fi
if [ "${1:-}" = tools ] && ! stamped tools_key; then
    echo 'setup: installing what testing and checking need'
    install_lock requirements-dev.lock
    stamp tools_key
fi
