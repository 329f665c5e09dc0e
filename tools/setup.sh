#!/bin/sh
# Make .venv: the locked dependencies and this project, editable. Does nothing when nothing
# changed. Called by `make setup`; PYTHON names the interpreter, VENV the folder.
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

# Whether .venv still runs, and on the interpreter that was asked for, if one was.
fits() {
    which='import sys; print(sys.base_prefix, sys.version)'
    found=$("$VENV/bin/python" -c "$which" 2>/dev/null) || return 1
    [ -z "${PYTHON:-}" ] || [ "$found" = "$("$PYTHON" -c "$which" 2>/dev/null)" ]
}

# What the installation of this project depends on; its modules and its data stay in the tree.
project_key() {
    cat setup.py setup.cfg pyproject.toml
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

install_dependencies() {
    pip="$VENV/bin/python -m pip --disable-pip-version-check --no-input -q"
    echo 'setup: installing the locked dependencies'
    $pip install --require-hashes -r requirements-build.lock ||
        die "could not install the builder (see above): is a Python package index reachable?"
    # pip is the way out where only pip is set up for the index.
    UV_LINK_MODE=copy "$VENV/bin/uv" pip install -q --python "$VENV/bin/python" \
        --compile-bytecode --no-build-isolation --require-hashes -r requirements.lock ||
        $pip install --no-build-isolation --require-hashes -r requirements.lock ||
        die "could not install the dependencies (see above)"
}

install_project() {
    echo 'setup: installing experience_controller'
    "$VENV/bin/python" -m pip --disable-pip-version-check --no-input -q install --no-deps \
        --no-build-isolation --editable . || die 'could not install this project (see above)'
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

if ! { stamped dependencies_key && fits; }; then
    make_venv
    install_dependencies
    stamp dependencies_key
fi
if ! stamped project_key; then
    rm -f "$STAMP-project_key"
    install_project
    stamp project_key
fi
