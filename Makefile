# What there is to do with Alhazen. Every target sets up what it needs (scripts/setup.sh: a second
# when nothing is missing); a fresh Debian with Rust, make and root (or sudo) is enough.

CARGO ?= cargo
SETUP := ./scripts/setup.sh

.PHONY: help setup build demo test verify bench slurm fuzz lint doc clean

help: ## Lists these targets
	@sed -n 's/^\([a-z]*\):.*## \(.*\)/make \1\t\2/p' Makefile | expand -t 14

setup: ## Installs the C compiler, libclang and Embree 4 where they are missing
	@$(SETUP) build

build: setup ## Builds the release binary: target/release/alhazen
	$(CARGO) build --release --locked

demo: build ## Renders scenes/showcase.toml to out/showcase.exr and out/showcase.png
	@mkdir -p out
	$(CARGO) run --release --locked --quiet -- render scenes/showcase.toml -o out/showcase.exr -o out/showcase.png

test: ## Runs every test, with and without Embree
	@$(SETUP) test
	PROPTEST_RNG_SEED=1 $(CARGO) test --locked
	PROPTEST_RNG_SEED=1 $(CARGO) test --locked --no-default-features

verify: test slurm ## Runs what takes longer: many more random rays, scenes, seeds and kills, others each time
	ALHAZEN_VERIFY=1 $(CARGO) test --locked --release --no-fail-fast

slurm: build ## Tries the job array on a Slurm of one node, which it sets up (as root) and ends
	./scripts/slurm/try.sh

bench: setup ## Measures ray queries, the variants, every option, and other renderers
	$(CARGO) bench --locked --features crates

fuzz: ## Feeds every parser with broken input, SECONDS (600) each; ends at the first finding
	@$(SETUP) fuzz
	./scripts/fuzz.sh $(or $(SECONDS),600)

lint: setup ## Formatting, clippy and documentation without warnings; locks that fit
	$(CARGO) fmt --check
	$(CARGO) update --quiet --locked --workspace --manifest-path fuzz/Cargo.toml
	$(CARGO) clippy --locked --all-targets --features crates -- -D warnings
	$(CARGO) clippy --locked --all-targets --no-default-features -- -D warnings
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --locked --no-deps --document-private-items

doc: setup ## Builds the library's documentation: target/doc/alhazen
	$(CARGO) doc --locked --no-deps

clean: ## Removes what was built; the Embree of .embree stays
	$(CARGO) clean
