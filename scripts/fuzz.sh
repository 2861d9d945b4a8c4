#!/bin/sh
# Runs the fuzz targets of fuzz/ on stable Rust, each for some time; ends at the first finding.
#
#   scripts/fuzz.sh 600            every target, 600 seconds each
#   scripts/fuzz.sh 60 ply obj     these two
#   scripts/fuzz.sh merge ply      minimises the corpus of this one (all, where none is named)
#
# A finding is kept in fuzz/artifacts/TARGET/; give its path to fuzz/target/*/release/TARGET to see it
# again. New inputs that reach new code are added to fuzz/corpus/TARGET/.
set -eu

time=${1:?seconds for each target, or merge}
shift
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
cd "$root/fuzz"
[ $# -gt 0 ] || set -- $(sed -n 's/^path = "fuzz_targets\/\(.*\)\.rs"$/\1/p' Cargo.toml)

# What cargo-fuzz passes on nightly, without the sanitizers, for which the code has no use: nearly all of
# it is safe Rust. Counters, their addresses and compared values guide libFuzzer.
host=$(rustc -vV | sed -n 's/^host: //p')
RUSTFLAGS="--cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
-Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
-Cllvm-args=-sanitizer-coverage-trace-compares -Ctarget-cpu=x86-64-v3"
export RUSTFLAGS
# With a target named, build scripts and macros are not instrumented.
cargo build --release --locked --target "$host"

# Readers take paths: inputs are files, in memory.
TMPDIR=$(mktemp -d -p /dev/shm alhazen-fuzz.XXXXXX)
export TMPDIR
trap 'rm -rf "$TMPDIR"' EXIT
trap 'exit 130' INT TERM
export RAYON_NUM_THREADS=1

for target in "$@"; do
    program=target/$host/release/$target
    mkdir -p "corpus/$target" "artifacts/$target"
    dict=
    [ -f "dictionaries/$target.txt" ] && dict="-dict=dictionaries/$target.txt"
    if [ "$time" = merge ]; then
        mkdir "$TMPDIR/merged"
        "$program" -set_cover_merge=1 -rss_limit_mb=2048 "$TMPDIR/merged" "corpus/$target" 2>/dev/null
        rm -r "corpus/$target"
        mv "$TMPDIR/merged" "corpus/$target"
        du -sh "corpus/$target"
        continue
    fi
    # No input is worth more memory than this, nor more time.
    # shellcheck disable=SC2086  # empty, where there is none
    "$program" $dict -max_total_time="$time" -max_len=4096 -timeout=60 -rss_limit_mb=512 -malloc_limit_mb=256 \
        -print_final_stats=1 -verbosity=0 -artifact_prefix="artifacts/$target/" "corpus/$target" ||
        { echo "fuzz: $target: a finding in fuzz/artifacts/$target" >&2; exit 1; }
    echo "fuzz: $target: $time s without a finding" >&2
done
