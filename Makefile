# `make page` is for people, `make demo` shows everything, `make test` and `make check` are what has to pass.
# The interpreter is found by itself; `make PYTHON=/path/to/python3.12 demo` names one.

VENV := .venv
BIN := $(VENV)/bin
# Every package of the top folder.
CODE := $(patsubst %/__init__.py,%,$(wildcard */__init__.py)) launch test tools setup.py
DEMO_ARGS ?=
PAGE_ARGS ?=
TEST_ARGS ?=
BENCH_ARGS ?=
EVALUATION_ARGS ?=
CHANGING_ARGS ?=

export PYTHON VENV
# A sourced ROS or another virtual environment must not shine through: the libraries of two
# installations do not mix in one process. Without compiled files every process compiles anew.
unexport PYTHONPATH PYTHONHOME VIRTUAL_ENV AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH \
	RMW_IMPLEMENTATION LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE PYTHONDONTWRITEBYTECODE

.PHONY: demo page setup tools test test-all check bench evaluation lock clean

demo: setup
	$(BIN)/experience demo $(DEMO_ARGS)

# To teach and to watch a simulated robot in a browser, until Ctrl-C.
page: setup
	@$(BIN)/experience page $(PAGE_ARGS)

# What runs; and what testing and checking need on top.
setup:
	@sh tools/setup.sh

tools:
	@sh tools/setup.sh tools

PYTEST := $(BIN)/python -m pytest -n auto --dist loadfile --no-loadscope-reorder
test: tools
	$(BIN)/python tools/compile_kernels.py
	$(PYTEST) $(TEST_ARGS)

# With what is marked `long` as well.
test-all: tools
	$(PYTEST) -m '' $(TEST_ARGS)

check: tools
	$(BIN)/ruff check $(CODE)
	$(BIN)/flake8 $(CODE)
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python tools/check_dependencies.py
	$(BIN)/python tools/documents.py
	$(BIN)/python tools/architecture.py --check
	$(BIN)/python tools/parameter_tables.py --check
	sh tools/check_javascript.sh

bench: tools
	$(BIN)/python -m benchmarks.speed $(BENCH_ARGS)

evaluation: tools
	$(BIN)/python -m benchmarks.evaluation $(EVALUATION_ARGS)
	$(BIN)/python -m benchmarks.changing_worlds --methods 4 --write $(CHANGING_ARGS)

# Only for who changes requirements*.in: find the newest versions for both Pythons and lock them.
LOCK := $(BIN)/uv pip compile -q --upgrade --universal --python-version 3.11 \
	--fork-strategy fewest --generate-hashes --no-emit-index-url --no-emit-find-links \
	--no-annotate --no-header
lock: tools
	$(LOCK) requirements-build.in -o requirements-build.lock
	$(LOCK) requirements.in -o requirements.lock
	$(LOCK) -c requirements.lock requirements-dev.in -o requirements-dev.lock

clean:
	rm -rf $(VENV) build install log out .pytest_cache .mypy_cache .ruff_cache \
		.import_linter_cache .hypothesis *.egg-info
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
