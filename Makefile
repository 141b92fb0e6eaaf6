# `make test` and `make demo` need Python 3.11 or newer and make; what else they need they fetch:
# into .venv by pip and, as root on Debian or Ubuntu, the OpenGL libraries by apt.
# `make test-clients` adds what Blender 4.5 and 5.0 (both need Python 3.11), three.js and Godot 3
# make of the files.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
CLIENTS := .clients
BPY_PYTHON ?= python3.11
DEMO := demo-out
EXAMPLE := examples/hairkit-sobel
LIBRARIES := libegl1 libgl1 libgl1-mesa-dri libosmesa6
DISPLAYS := xvfb chromium
ENGINES := xvfb xauth godot3

.PHONY: test test-clients test-slow demo lint docs matrix resolve wheel sbom bench clean

# A worker has one core: threads of matrix products would wait for each other.
test test-clients: export OPENBLAS_NUM_THREADS := 1

test: $(VENV)/.tests $(VENV)/.kernels
	@sh .ci/libraries $(DISPLAYS)
	@sh .ci/validator $(CLIENTS)
	$(BIN)/python -m pytest -n auto --dist worksteal --ignore tests/clients

test-clients: $(VENV)/.tests $(CLIENTS)/.blender
	@sh .ci/libraries $(ENGINES)
	@sh .ci/validator $(CLIENTS)
	@sh .ci/three $(CLIENTS)
	$(BIN)/python -m pytest -n auto --dist worksteal tests/clients

# The studio and a batch whose processes are killed at random moments.
test-slow: $(VENV)/.tests $(VENV)/.kernels
	$(BIN)/python tests/slow/studio_kills.py
	$(BIN)/python tests/slow/batch_chaos.py

demo: $(VENV)/.kernels
	$(BIN)/hairkit reconstruct hairkit/sample -o $(DEMO)
	@echo "Your hair is in $(DEMO)/: look at $(DEMO)/contact_sheet.png, open groom.glb (head and"
	@echo "hair) or groom.abc (strands) in Blender, groom.apx in HairWorks, or move it here:"
	@echo "  $(BIN)/hairkit view $(DEMO)/groom.npz"

lint: $(VENV)/.lint
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	@sh .ci/eslint $(CLIENTS)
	$(BIN)/mypy

docs: $(VENV)/.docs
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet
	@echo "The site is in build/site/: open build/site/index.html"

matrix: $(VENV)/.hairkit
	$(BIN)/python .ci/matrix.py $(MATRIX)

# Whether Windows and macOS have wheels of all dependencies.
resolve: $(VENV)/.python
	$(BIN)/python .ci/resolve.py

# A wheel for this Python on x86-64 Linux, with compiled kernels: its first run compiles nothing.
wheel: $(VENV)/.tests $(VENV)/.models $(VENV)/.lint
	$(BIN)/python .ci/wheel.py dist

# What an installation with all extras for users consists of, with the licences (CycloneDX).
sbom: $(VENV)/.python
	$(PYTHON) -m venv --clear build/sbom && $(PYTHON) -m venv --clear build/cyclonedx
	build/sbom/bin/python -m pip install --quiet --disable-pip-version-check '.[all]'
	build/cyclonedx/bin/python -m pip install --quiet --disable-pip-version-check 'cyclonedx-bom>=7,<8'
	@mkdir -p dist
	build/cyclonedx/bin/cyclonedx-py environment --pyproject pyproject.toml --output-reproducible \
	  -o dist/hairkit.cdx.json build/sbom
	@echo "dist/hairkit.cdx.json names every package with its version and licence"

bench: $(VENV)/.tests
	$(BIN)/python benchmarks/bench.py -o bench.json
	@echo "bench.json keeps tables and seconds: python -m benchmarks.compare OLD bench.json"

clean:
	rm -rf $(VENV) $(CLIENTS) $(DEMO) build dist .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -o -name '*.egg-info' | xargs rm -rf

$(VENV)/.python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "hairkit needs Python 3.11 or newer; name one: make PYTHON=python3.12" >&2; exit 1; }
	@sh .ci/libraries $(LIBRARIES)
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || sh .ci/libraries python3-venv
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/.hairkit: $(VENV)/.python pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e .
	@touch $@

$(VENV)/.models: $(VENV)/.hairkit hairkit/nets/known_models.py
	@if $(BIN)/hairkit models install >/dev/null; then touch $@; else \
	  echo "the networks could not be installed: faces and persons are not found, and tests that" >&2; \
	  echo "need networks are skipped; get them by hand: $(BIN)/hairkit models --help" >&2; fi

# A part of the installation: the first reconstruction, simulation and view are then as fast as any
# other, and tests find most kernels compiled. Without OpenGL the viewer compiles when it starts.
$(VENV)/.kernels: $(VENV)/.models
	@echo "compiling the kernels of reconstruction, simulation and viewer, once on this machine"
	@$(BIN)/hairkit reconstruct hairkit/sample -o $(VENV)/first --guides 50 --quiet >/dev/null
	-@$(BIN)/hairkit view $(VENV)/first/groom.npz --headless --script .ci/look.toml \
	  --out $(VENV)/first >/dev/null
	@rm -rf $(VENV)/first
	@touch $@

$(VENV)/.tests: $(VENV)/.hairkit $(wildcard $(EXAMPLE)/*.*)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[test]'
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps ./$(EXAMPLE)
	@touch $@

$(CLIENTS)/.blender: .ci/blender
	@mkdir -p $(CLIENTS)
	@sh .ci/blender $(CLIENTS)/bpy 4.5 $(BPY_PYTHON) python3.11 $(PYTHON)
	@sh .ci/blender $(CLIENTS)/bpy5 5.0 $(BPY_PYTHON) python3.11 $(PYTHON)
	@touch $@

$(VENV)/.docs: $(VENV)/.hairkit
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[docs]'
	@touch $@

$(VENV)/.lint: $(VENV)/.hairkit
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
	@touch $@
