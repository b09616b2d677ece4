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
KERNEL := $(shell find crates -name '*.rs' -o -name Cargo.toml 2>/dev/null) Cargo.toml

.PHONY: demo test test-usb test-camera test-live fuzz coverage figures evaluation bench rust python stubs format bench peers clean

demo: $(STAMPS)/built
	$(BIN)/quadfringe demo --out out/demo

test: rust python test-usb test-camera test-live

rust: $(STAMPS)/tools
	cargo fmt --all --check
	PYO3_PYTHON=$(CURDIR)/$(BIN)/python cargo clippy --workspace --all-targets -- -D warnings
	cargo clippy --package lightcrafter --all-targets --all-features -- -D warnings
	cargo test
	cargo test --package lightcrafter --no-default-features --features emulator
	for example in crates/quadfringe/examples/*.rs; do \
		cargo run --release --quiet --package quadfringe --example "$$(basename "$$example" .rs)"; done
	cargo run --quiet --package lightcrafter --features emulator --example one_image
	RUSTDOCFLAGS="-D warnings" cargo doc --package quadfringe --no-deps --quiet
	RUSTDOCFLAGS="-D warnings" cargo doc --package lightcrafter --all-features --no-deps --quiet

python: $(STAMPS)/built stubs
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/pytest

stubs: $(STAMPS)/built
	$(BIN)/python -m mypy.stubtest quadfringe._core

# Two projectors in a umockdev testbed: the driver in Rust and through the wheel, over the real libusb, and the window
# under Xvfb.
test-usb: $(STAMPS)/built
	scripts/set-up testbed
	cargo test --package lightcrafter --all-features --lib --test libusb --test window
	cargo run --quiet --package lightcrafter --no-default-features --features testbed --bin lightcrafter-testbed -- $(BIN)/pytest tests/usb

# Two cameras on the wire of GigE Vision, in a network of its own that has nothing but the loopback interface.
test-camera: $(STAMPS)/camera
	if scripts/loopback true; then \
		scripts/loopback $(BIN)/pytest tests/camera && \
		scripts/loopback $(BIN)/python benches/camera.py --seconds 3; \
	elif [ -n "$${CI:-}" ]; then exit 1; else echo "test-camera is skipped"; fi

$(STAMPS)/camera: $(STAMPS)/built
	scripts/set-up camera
	$(BIN)/pip install --quiet --disable-pip-version-check "PyGObject>=3.42,<3.52"
	touch $@

# The live view in Debian's chromium without a screen.
test-live: $(STAMPS)/built
	scripts/set-up browser
	QUADFRINGE_BROWSER=1 $(BIN)/pytest tests/live

# Any bytes to the decoders, the driver and the emulator, on the stable compiler: libFuzzer with LLVM's counters.
FUZZ_SECONDS ?= 300
FUZZ := crates/lightcrafter/fuzz
COUNTERS := -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
	-Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
	-Cllvm-args=-sanitizer-coverage-trace-compares -Ccodegen-units=1
FUZZ_HOST := $(shell rustc -vV 2>/dev/null | sed -n 's/^host: //p')
fuzz:
	mkdir -p $(FUZZ)/corpus $(FUZZ)/artifacts
	RUSTFLAGS="$(COUNTERS)" cargo run --release --quiet --manifest-path $(FUZZ)/Cargo.toml --target $(FUZZ_HOST) -- \
		$(FUZZ)/corpus -artifact_prefix=$(FUZZ)/artifacts/ -max_total_time=$(FUZZ_SECONDS) -max_len=4096 -print_final_stats=1

# Lines of the crate lightcrafter that its tests run; fails below 90 %.
coverage:
	scripts/set-up testbed
	scripts/coverage

# Pictures and figures of the README; nothing in it is drawn or typed by hand.
figures: $(STAMPS)/built
	$(BIN)/python docs/draw_pictures.py
	$(BIN)/python evaluation/figures.py

# Accuracy into evaluation/RESULTS.md.
evaluation: $(STAMPS)/built
	$(BIN)/python evaluation/results.py

# Times, memory and other packages into benches/RESULTS.md; let the machine do nothing else meanwhile.
bench: $(STAMPS)/peers
	$(BIN)/python benches/results.py

peers: $(STAMPS)/peers

# Fringes asks for another OpenCV wheel than ours, and two of them in one environment overwrite each other.
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

# An editable install: Python changes need nothing, Rust changes rebuild here, always optimised.
$(STAMPS)/built: $(STAMPS)/tools $(KERNEL)
	@echo "building the kernel and installing the package (some minutes the first time)"
	PIP_QUIET=1 PATH="$(CURDIR)/$(BIN):$$PATH" VIRTUAL_ENV=$(CURDIR)/$(VENV) $(BIN)/maturin develop --release --quiet --extras test
	touch $@

clean:
	rm -rf $(VENV) target out
