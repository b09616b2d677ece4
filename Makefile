# Two commands do everything on a machine with Python 3.11+ and Rust from rustup:
#   make demo   one shot on the virtual bench, one shape, a report and a PLY in out/demo
#   make test   every check that CI runs

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMPS := $(VENV)/stamps
KERNEL := $(shell find crates/*/src -name '*.rs' 2>/dev/null) $(wildcard crates/*/Cargo.toml) Cargo.toml Cargo.lock

.PHONY: demo test installed docs test-usb test-camera test-live wheel wheel-test cross publish-check msrv lowest semver workflows \
	audit release fuzz miri hostile coverage figures evaluation bench rust python stubs format bench peers clean

demo: $(STAMPS)/built
	$(BIN)/quadfringe demo --out out/demo

# Two parts at a time: the kernel's tests beside the wheel and what the later parts install, which mostly waits for the network;
# the site fills what the tests of the package leave idle, and browser and projectors mostly wait. The cameras have the machine
# to themselves, because frames are lost on a busy one.
test:
	$(MAKE) --jobs 2 rust installed
	$(MAKE) wheel-test
	$(MAKE) --jobs 2 python docs
	$(MAKE) --jobs 2 test-usb test-live
	$(MAKE) test-camera

# All that the parts of `test` need, one after another: two installations at once disturb each other.
installed: $(STAMPS)/built
	$(MAKE) --jobs 1 $(STAMPS)/wheel $(STAMPS)/docs $(STAMPS)/camera
	scripts/set-up testbed
	scripts/set-up browser

# One set of features and one profile for all tests, examples and the testbed, so that nothing is compiled twice. Features
# only add code, so the tests of the largest set run all that a smaller one runs; the smallest one is compiled alone.
CARGO_ALL := --package quadfringe --package lightcrafter --all-features
# `cargo test` builds examples and programs here.
BUILT := $(or $(CARGO_TARGET_DIR),target)/debug
# These two tests start a umockdev testbed and an X server, which scripts/set-up installs; test-usb runs them.
TESTBEDS := under_umockdev under_xvfb

rust: $(STAMPS)/tools
	cargo fmt --all --check
	PYO3_PYTHON=$(CURDIR)/$(BIN)/python cargo clippy --workspace --all-targets --all-features -- -D warnings
	cargo clippy --package lightcrafter --all-targets --no-default-features --features emulator -- -D warnings
	PYO3_PYTHON=$(CURDIR)/$(BIN)/python cargo clippy --package quadfringe-python --no-default-features -- -D warnings
	cargo test $(CARGO_ALL) -- $(TESTBEDS:%=--skip %)
	for example in crates/*/examples/*.rs; do $(BUILT)/examples/"$$(basename "$$example" .rs)"; done
	RUSTDOCFLAGS="-D warnings" cargo doc $(CARGO_ALL) --no-deps --quiet

# Each process gets half of the tests and, when it is done, takes some from the end of the other's.
python: $(STAMPS)/built stubs
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/pytest --numprocesses 2 --dist worksteal

# The documentation site, into out/docs: every notebook and every picture of the gallery is computed; warnings are errors.
docs: $(STAMPS)/docs
	PYTHONPATH=$(CURDIR)/docs/extensions $(BIN)/sphinx-build -W --keep-going -q -j 2 -d out/doctrees docs out/docs
	@echo "open out/docs/index.html"

$(STAMPS)/docs: $(STAMPS)/built
	$(BIN)/pip install --quiet --disable-pip-version-check "$$(ls $(VENV)/editable/quadfringe-*.whl)[docs]"
	touch $@

# The wheel for this machine, with the list of all crates in it. On Linux, Zig links it against glibc 2.17, the oldest that
# Rust supports, and $(BASELINE) is checked (docs/decisions/0042-*.md); elsewhere the linker of the system is used.
BASELINE := manylinux_2_17
ifeq ($(shell uname -s),Linux)
OLDEST := --zig --compatibility $(BASELINE)
endif
WHEEL_TOOLS := "abi3audit>=0.0.26" "auditwheel>=6.4" "uv>=0.9"
define build-wheel
rm -f dist/*.whl
PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/maturin build --release --quiet $(OLDEST) --out dist
endef

# Cargo has nothing to do here after `built`; the Python files may be newer.
wheel: $(STAMPS)/wheel
	$(build-wheel)
	$(BIN)/python scripts/check_wheel.py dist/quadfringe-*.whl $(if $(OLDEST),$(BASELINE))

$(STAMPS)/wheel: $(STAMPS)/built
	$(BIN)/pip install --quiet --disable-pip-version-check $(WHEEL_TOOLS)
	touch $@

# The wheel in new environments outside the checkout, with no compiler: every module, the demonstration, files, each extra
# alone. EXTRAS=all tries also those that are too large for every run.
EXTRAS ?= light
wheel-test: wheel
	QUADFRINGE_WHEEL=$(EXTRAS) $(BIN)/pytest tests/wheel --numprocesses 2 --dist loadfile --durations 5

# The wheel for another machine, by Zig, with the oldest system that it must run on; it cannot be tried here. One at a time:
# maturin puts the modules of all targets into one folder.
#   make cross TARGET=aarch64-unknown-linux-gnu
#   make cross TARGET=x86_64-unknown-linux-musl OLDEST_THERE=musllinux_1_2
TARGET ?= aarch64-unknown-linux-gnu
OLDEST_THERE ?= $(BASELINE)
cross: $(STAMPS)/tools
	rustup target add $(TARGET)
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/maturin build --release --quiet --zig --compatibility $(OLDEST_THERE) \
		--target $(TARGET) --out dist/$(TARGET)
	$(BIN)/pip install --quiet --disable-pip-version-check $(WHEEL_TOOLS)
	$(BIN)/python scripts/check_wheel.py dist/$(TARGET)/quadfringe-*.whl $(OLDEST_THERE)

# Both crates as they would be published, compiled from their packages, and the source distribution of the package.
publish-check: $(STAMPS)/tools
	cargo publish --dry-run --package lightcrafter --package quadfringe
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/maturin sdist --out dist/sdist

# The oldest Rust that Cargo.toml promises compiles everything.
MSRV := $(shell sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)
msrv:
	rustup toolchain install $(MSRV) --profile minimal
	cargo +$(MSRV) check --workspace --all-features --all-targets

# The tests with the oldest Python packages that pyproject.toml permits; these warn of each other's age.
LOWEST_TESTS ?= tests
lowest: $(STAMPS)/wheel
	$(BIN)/uv venv --quiet --clear --python $(BIN)/python $(VENV)/lowest
	$(BIN)/uv pip install --quiet --python $(VENV)/lowest --resolution lowest-direct \
		-r pyproject.toml --extra test --extra e57
	$(BIN)/uv pip install --quiet --python $(VENV)/lowest --no-deps $(VENV)/editable/quadfringe-*.whl
	PYTHONWARNINGS=ignore::DeprecationWarning \
		$(VENV)/lowest/bin/python -m pytest -p no:cacheprovider -W ignore::DeprecationWarning $(LOWEST_TESTS)

# Changes of the crates' interfaces since the last tagged version, which need a higher number; before the first tag there is
# nothing to compare with.
SEMVER_BASE ?= $(shell git describe --tags --abbrev=0 HEAD^ 2>/dev/null)
semver:
ifeq ($(SEMVER_BASE),)
	@echo "no earlier version is tagged: there is nothing to compare with"
else
	cargo install --quiet --locked cargo-semver-checks
	cargo semver-checks --package lightcrafter --package quadfringe --baseline-rev $(SEMVER_BASE)
endif

# The workflows of .github against their schema and for unsafe steps; CI runs actionlint too, which comes as a
# program from GitHub.
workflows: $(STAMPS)/tools
	$(BIN)/pip install --quiet --disable-pip-version-check "check-jsonschema>=0.33" "zizmor>=1.16"
	$(BIN)/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	$(BIN)/zizmor --offline --config .github/zizmor.yml .github/workflows

# Licences and sources of all crates, and known faults of them and of the Python packages in .venv, which are those of all
# extras, from two databases on the network; dist/python.cdx.json lists the packages.
audit: $(STAMPS)/audit wheel
	for crate in . $(FUZZ_CRATES); do cargo deny --manifest-path $$crate/Cargo.toml --config .cargo/deny.toml check; done
	$(BIN)/pip freeze --exclude quadfringe > dist/python.txt
	$(BIN)/pip-audit --strict --no-deps --disable-pip --requirement dist/python.txt \
		--format cyclonedx-json --output dist/python.cdx.json

release: export EXTRAS = all
release: test audit

$(STAMPS)/audit: $(STAMPS)/built
	cargo install --quiet --locked cargo-deny
	$(BIN)/pip install --quiet --disable-pip-version-check "pip-audit>=2.9,<3"
	touch $@

stubs: $(STAMPS)/built
	$(BIN)/python -m mypy.stubtest quadfringe._core

# Two projectors in a umockdev testbed: the driver in Rust and through the wheel, over the real libusb, and the window
# under Xvfb; then the times of the driver.
test-usb: $(STAMPS)/built
	scripts/set-up testbed
	cargo test $(CARGO_ALL) --test libusb --test window
	$(BUILT)/lightcrafter-testbed $(BIN)/pytest tests/usb
	$(BUILT)/lightcrafter-testbed $(BIN)/python benches/projector.py

# Two cameras over GigE Vision, in network namespaces that have only the loopback interface. Most tests wait for frames and for
# time-outs, so that four workers, each in a namespace of its own, do not load two cores. Those in CAMERA_ALONE assert that no
# frame is lost while much is computed or written; they run one after another.
CAMERA_WORKERS := 4*popen//python=scripts/loopback $(BIN)/python
CAMERA_ALONE := $(addprefix tests/camera/,test_clock_jump.py test_moving_scene.py test_slow_disk.py)
test-camera: $(STAMPS)/camera
	if scripts/loopback true; then \
		$(BIN)/pytest tests/camera $(CAMERA_ALONE:%=--ignore=%) --tx "$(CAMERA_WORKERS)" --dist worksteal && \
		scripts/loopback $(BIN)/pytest $(CAMERA_ALONE) && \
		scripts/loopback $(BIN)/python benches/camera.py --seconds 3; \
	elif [ -n "$${CI:-}" ]; then exit 1; else echo "test-camera is skipped"; fi

$(STAMPS)/camera: $(STAMPS)/built
	scripts/set-up camera
	$(BIN)/pip install --quiet --disable-pip-version-check "PyGObject>=3.42,<3.52"
	touch $@

# The live view in headless chromium.
test-live: $(STAMPS)/built
	scripts/set-up browser
	QUADFRINGE_BROWSER=1 $(BIN)/pytest tests/live --numprocesses 2 --dist worksteal

# Random bytes to the projector driver and its emulator, and as images and numbers of the kernel: libFuzzer on the stable
# compiler, with LLVM's counters. Changed files to every reader: libFuzzer in Python, by Atheris. Each gets an equal share
# of the seconds.
FUZZ_SECONDS ?= 300
FUZZ_CRATES := crates/lightcrafter/fuzz crates/quadfringe/fuzz
FUZZ_READERS := recording calibration response system shape member npy opencv png image
FUZZ_TARGETS := $(FUZZ_CRATES:%=%/run) $(FUZZ_READERS:%=fuzz-%)
FUZZ_SHARE = $$(( $(FUZZ_SECONDS) / $(words $(FUZZ_TARGETS)) ))
COUNTERS := -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
	-Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
	-Cllvm-args=-sanitizer-coverage-trace-compares -Ccodegen-units=1
FUZZ_HOST := $(shell rustc -vV 2>/dev/null | sed -n 's/^host: //p')
.PHONY: $(FUZZ_TARGETS)
fuzz: $(FUZZ_TARGETS)

$(FUZZ_CRATES:%=%/run): %/run:
	mkdir -p $*/corpus $*/artifacts
	RUSTFLAGS="$(COUNTERS)" cargo run --release --quiet --manifest-path $*/Cargo.toml --target $(FUZZ_HOST) -- \
		$*/corpus -artifact_prefix=$*/artifacts/ -max_total_time=$(FUZZ_SHARE) -max_len=4096 -timeout=20 -print_final_stats=1

$(FUZZ_READERS:%=fuzz-%): fuzz-%: $(STAMPS)/fuzz
	cd tests && ../$(BIN)/python -m hostile.fuzz $* -max_total_time=$(FUZZ_SHARE) -print_final_stats=1

# Atheris has wheels for Linux on x86-64.
$(STAMPS)/fuzz: $(STAMPS)/built
	$(BIN)/pip install --quiet --disable-pip-version-check "atheris>=3,<4"
	touch $@

# Small tests of the kernel in Miri, which finds undefined behaviour; they take some minutes. Those that are skipped loop
# over many numbers. Rayon's threads never end, and its queues follow the rules of tree borrows but not of stacked borrows.
MIRI_TESTS := condition::registered condition::tests decode::method encoding:: error:: height::polynomial \
	joint::energy::layout joint::validity optics:: parallel:: rig::mosaic rig::truth stages::n_step surface::posed
MIRI_SKIPS := known_phase_is_recovered shift_scale_and_turn arctangents_stay sine_and_cosine_stay wrapping_stays
MIRI_FLAGS := -Zmiri-tree-borrows -Zmiri-permissive-provenance -Zmiri-ignore-leaks -Zmiri-disable-isolation
miri:
	rustup component add miri rust-src --toolchain nightly
	MIRIFLAGS="$(MIRI_FLAGS)" RAYON_NUM_THREADS=2 cargo +nightly miri test --package quadfringe --lib -- \
		--test-threads 1 $(MIRI_TESTS) $(MIRI_SKIPS:%=--skip %)

# Damaged files to every reader, spoilt shots to both methods, killed writers and batches, by seeds; `make test` runs a sample.
HOSTILE_FILES ?= 1000
HOSTILE_RECORDINGS ?= 3000
HOSTILE_SHOTS ?= 100
HOSTILE_KILLS ?= 50
hostile: $(STAMPS)/built
	cd tests && ../$(BIN)/python -m hostile --count $(HOSTILE_FILES)
	cd tests && ../$(BIN)/python -m hostile --shots $(HOSTILE_SHOTS)
	$(BIN)/python tests/hostile/mutated_recordings.py --count $(HOSTILE_RECORDINGS)
	$(BIN)/python tests/hostile/kills.py --kills $(HOSTILE_KILLS)

# Share of the lines of the crate lightcrafter that its tests run; fails below 90 %.
coverage:
	scripts/set-up testbed
	scripts/coverage

# The picture of the README, docs/figures.md, and the figures of both.
figures: $(STAMPS)/built
	$(BIN)/python docs/draw_pictures.py
	$(BIN)/python evaluation/figures.py

# Accuracy into evaluation/RESULTS.md.
evaluation: $(STAMPS)/built
	$(BIN)/python evaluation/results.py

# Times, memory and other packages into benches/RESULTS.md; run it on an idle machine.
bench: $(STAMPS)/peers
	$(BIN)/python benches/results.py

peers: $(STAMPS)/peers

# Fringes requires another OpenCV wheel than quadfringe; two of them in one environment overwrite each other.
$(STAMPS)/peers: $(STAMPS)/built benches/requirements.txt
	$(BIN)/pip install --quiet --disable-pip-version-check -r benches/requirements.txt
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps "Fringes>=2.1,<3"
	touch $@

format: $(STAMPS)/tools
	cargo fmt --all
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

$(STAMPS)/tools: pyproject.toml scripts/set-up
	scripts/set-up "$(PYTHON)" "$(VENV)"
	mkdir -p $(STAMPS)
	touch $@

# An editable install of the wheel: Python changes take effect at once, Rust changes rebuild here, always optimised.
$(STAMPS)/built: $(STAMPS)/tools $(KERNEL)
	@echo "building the kernel and installing the package (some minutes the first time)"
	$(build-wheel)
	$(BIN)/pip install --quiet --disable-pip-version-check \
		"$$($(BIN)/python scripts/editable.py dist/quadfringe-*.whl $(VENV)/editable)[test]"
	touch $@

clean:
	rm -rf $(VENV) target out docs/generated
