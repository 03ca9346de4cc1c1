# Each goal sets up everything that it needs in this folder: a virtual environment in .venv and a release build.
# make demo | test | fuzz | levels | lint | bench | wheel | docs | format | clean

PYTHON ?= python3
VENV := .venv
PEERS := .venv-peers
BIN := $(VENV)/bin
JOBS ?= $(shell getconf _NPROCESSORS_ONLN 2>/dev/null || echo 2)
MINUTES ?= 10
# Tests that only read files. `make lint` runs them.
STATIC := tests/test_architecture.py tests/test_architecture_rust.py
RUST := Cargo.toml $(shell find rust -name '*.rs')

.PHONY: help demo test test-rust test-python fuzz fuzz-kernels sanitize kills levels audit lint lint-rust lint-python format bench bench-kernels bench-guard wheel docs docs-check clean requirements
.DELETE_ON_ERROR:
# Compilers count the processors themselves, so they must not inherit the job count of make.
unexport MAKEFLAGS

help:
	@echo "make demo    images of every system on built-in examples: demo/index.html"
	@echo "make test    all tests, Rust and Python"
	@echo "make fuzz    random cases, hostile values, damaged files, for about ten minutes (MINUTES=10)"
	@echo "make fuzz-kernels  only the targets in fuzz/, which share MINUTES (needs a nightly compiler)"
	@echo "make sanitize  the Rust tests with checked addresses (needs a nightly compiler)"
	@echo "make kills   commands killed at random moments (COUNT=200)"
	@echo "make levels  compare stored results on lesser processors, some of them emulated (qemu-user)"
	@echo "make lint    formatting, clippy, rustdoc, ruff, mypy, stubtest"
	@echo "make audit   licences and known defects of all dependencies (cargo-deny, if it is installed)"
	@echo "make format  format the sources"
	@echo "make bench   compare texrs with other libraries and programs: benches/peers.json"
	@echo "make bench-kernels  criterion benches of the kernels"
	@echo "make bench-guard  compare the instruction counts of the hottest kernels with the stored ones (valgrind)"
	@echo "make wheel   a wheel and a source distribution in dist/, tested in clean environments"
	@echo "make docs    documentation, gallery and reference: docs/_build/html/index.html"
	@echo "make docs-check  check these pages in a browser: accessibility, weight, links"
	@echo "make clean   remove the files of the other goals"

requirements:
	@command -v $(PYTHON) >/dev/null 2>&1 || { echo "texrs needs Python 3.11 or newer: $(PYTHON) was not found (make PYTHON=/path/to/python3)" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "texrs needs Python 3.11 or newer: $(PYTHON) is $$($(PYTHON) -V 2>&1) (make PYTHON=/path/to/python3)" >&2; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { echo "texrs needs Python's venv module, which $(PYTHON) lacks (on Debian: apt install python3-venv)" >&2; exit 1; }
	@command -v cargo >/dev/null 2>&1 || { echo "texrs needs a Rust toolchain: cargo was not found (see https://rustup.rs)" >&2; exit 1; }

$(VENV)/.tools: pyproject.toml constraints.txt | requirements
	@[ -x $(BIN)/python ] || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade 'pip>=25.1'
	$(BIN)/python -m pip install --quiet --group dev --constraint constraints.txt
	@touch $@

$(VENV)/.built: $(VENV)/.tools $(RUST)
	PIP_QUIET=1 PIP_CONSTRAINT=$(abspath constraints.txt) VIRTUAL_ENV=$(abspath $(VENV)) $(BIN)/maturin develop --release --quiet
	@touch $@

demo: $(VENV)/.built
	$(BIN)/texrs demo -o demo --force
	@echo "Open demo/index.html in a browser."

# All Rust tests are in the library, because building it again for separate test programs takes a minute. Each worker uses one
# thread, because the workers share the processors; tests of threads request more. Byte code is always kept, because the tests
# start dozens of processes.
test: test-rust test-python

test-rust: | requirements
	cargo test --quiet --lib

test-python: $(VENV)/.built
	PYTHONDONTWRITEBYTECODE= OPENBLAS_NUM_THREADS=1 RAYON_NUM_THREADS=1 $(BIN)/python -m pytest -n $(JOBS) --dist worksteal -q --durations=30 $(STATIC:%=--ignore=%)

# Property tests, all hostile values of all arguments, damaged files, and, with a nightly compiler, the targets in fuzz/. Each round
# has a seed. Rounds run until one fails or the time is up; SEED repeats one round.
fuzz: $(VENV)/.built
	@end=$$(($$(date +%s) + 60 * $(MINUTES))); \
	while seed=$(or $(SEED),$$(od -An -N4 -tu4 /dev/urandom | tr -d ' ')); do \
		echo "make fuzz SEED=$$seed"; \
		PROPTEST_RNG_SEED=$$seed cargo test --quiet --lib && \
		$(BIN)/python -m pytest tests -n $(JOBS) --dist worksteal -q -m 'hypothesis or fuzz' --hypothesis-profile fuzz --hypothesis-seed $$seed && \
		$(BIN)/python tests/fuzz_files.py --seed $$seed --seconds 300 && \
		$(BIN)/python .ci/fuzz --seed $$seed --seconds 300 || \
			{ echo "make fuzz SEED=$$seed repeats this" >&2; exit 1; }; \
		[ -z "$(SEED)" ] && [ $$(date +%s) -lt $$end ] || break; \
	done

# Continue the last run: inputs that covered more of the code are kept in fuzz/corpus.
fuzz-kernels: $(VENV)/.tools
	$(BIN)/python .ci/fuzz --seconds $$((60 * $(MINUTES))) $(TARGETS)

# A test that reads or writes outside an array fails. Checked addresses need larger stacks.
sanitize: | requirements
	RUSTFLAGS=-Zsanitizer=address RUST_MIN_STACK=33554432 cargo +nightly test --quiet --lib \
		--target $$(rustc -vV | sed -n 's/^host: //p')

# About ten minutes on a quiet machine. MINUTES bounds each level.
levels: $(VENV)/.built
	MINUTES=$(MINUTES) $(BIN)/python .ci/levels

# Kill commands at random moments, and run several that write to one file at once.
kills: $(VENV)/.built
	$(BIN)/python tests/kill_commands.py --count $(or $(COUNT),200)

# `make -j2 lint` checks both languages in parallel, because each leaves a processor idle.
lint: lint-rust lint-python audit

# Check the dependencies. cargo-deny downloads its database of advisories, so it needs a network.
audit: $(VENV)/.tools
	$(BIN)/python .ci/licences
	@if command -v cargo-deny >/dev/null; then cargo deny check; \
		else echo "advisories: not checked, because cargo-deny is not installed (cargo install cargo-deny)"; fi

# Clippy and rustdoc use the same features, so that dependencies are checked once.
lint-rust: | requirements
	cargo fmt --check
	cargo clippy --all-targets --quiet --features python -- -D warnings
	cargo clippy --quiet --features python,portable -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --no-deps --quiet --features python
	$(PYTHON) .ci/third-party --check

lint-python: $(VENV)/.built
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest texrs._rust
	$(BIN)/python .ci/prose
	$(BIN)/python .ci/names
	$(BIN)/python -m pytest -q $(STATIC)

format: $(VENV)/.tools
	cargo fmt
	$(BIN)/ruff check --fix --quiet . || true
	$(BIN)/ruff format .

# Compare with other libraries and programs, as the page on performance shows. They are in a separate environment, because some
# are under the GPL. ROWS="strip-512 ring-512" measures these rows again.
bench: $(VENV)/.built $(PEERS)/.tools
	$(BIN)/python benches/peers $(if $(ROWS),--only $(ROWS)) --rounds $(or $(ROUNDS),5)

$(PEERS)/.tools: pyproject.toml | requirements
	@[ -x $(PEERS)/bin/python ] || $(PYTHON) -m venv $(PEERS)
	$(PEERS)/bin/python -m pip install --quiet --upgrade 'pip>=25.1'
	$(PEERS)/bin/python -m pip install --quiet --group peers
	@touch $@

bench-kernels: | requirements
	cargo bench

# Instruction counts do not depend on other running programs. REGENERATE=1 stores new ones.
bench-guard: | requirements
	.ci/counts

# Build for this machine, and test in clean environments with each installed Python.
wheel: $(VENV)/.tools
	rm -rf dist
	$(BIN)/maturin build --release --quiet --out dist
	$(BIN)/maturin sdist --out dist
	$(BIN)/python .ci/wheel $(PYTHONS)

$(VENV)/.documented: $(VENV)/.built
	$(BIN)/python -m pip install --quiet --group docs
	@touch $@

# Build the Python pages, and those of the kernels in the folder rust. Warnings are errors.
docs: $(VENV)/.documented
	RUSTDOCFLAGS="-D warnings" cargo doc --no-deps --quiet
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html
	rm -rf docs/_build/html/rust && cp -r target/doc docs/_build/html/rust
	@echo "Open docs/_build/html/index.html in a browser."

# Check accessibility, weight, layout shift and links in a browser. Chromium and an earlier `make docs` are needed.
docs-check: $(VENV)/.tools
	$(BIN)/python -m pip install --quiet --group pages
	$(BIN)/python .ci/pages

clean:
	rm -rf $(VENV) $(PEERS) target fuzz/target fuzz/corpus fuzz/artifacts demo dist docs/_build docs/generated .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find python -name '*.so' -delete
