# Two commands: `make demo` shows the product, `make test` proves it.
PYTHON ?= python3.11
VENV   := .venv
BIN    := $(VENV)/bin
NPM    := $(shell command -v npm 2>/dev/null)

.PHONY: demo test benchmark samples clean

demo: $(VENV)/.installed
	$(BIN)/fba demo -o out/demo

test: $(VENV)/.installed-test peers
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n 2 --dist loadfile

# One report of fidelity, speed and memory, docs/benchmarks.md, and what it does not hold; PEERS=DIR adds public programs.
benchmark: $(VENV)/.installed-benchmark
	$(BIN)/python -m benchmarks.report --write --fidelity --against $(if $(PEERS),--peers $(PEERS))
	$(BIN)/python -m benchmarks.deformation

# Rebuild every shipped face and stream from its origin (needs the package index).
samples: $(VENV)/.installed-samples
	$(BIN)/python -m samples.build

$(VENV)/bin/python:
	@command -v $(PYTHON) >/dev/null 2>&1 && $(PYTHON) -m venv $(VENV) || python3 -m venv $(VENV)

$(VENV)/.installed: pyproject.toml $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[render]'
	@touch $@

$(VENV)/.installed-test: pyproject.toml $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[render,video,test]'
	@touch $@ $(VENV)/.installed

$(VENV)/.installed-benchmark: pyproject.toml $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[render,video,benchmark]'
	@touch $@

$(VENV)/.installed-samples: pyproject.toml $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[render,build-samples]'
	@touch $@

# Real clients from npm, for the tests that use them; without npm those tests are skipped.
.PHONY: peers
peers:
ifdef NPM
	@test -d tests/peers/node_modules -a tests/peers/node_modules -nt tests/peers/package-lock.json || \
	  $(NPM) ci --prefix tests/peers --silent --no-audit --no-fund || echo "npm packages could not be installed: peer tests will be skipped"
endif

clean:
	rm -rf out $(VENV) tests/peers/node_modules .mypy_cache .ruff_cache .pytest_cache
