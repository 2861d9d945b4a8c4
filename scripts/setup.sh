#!/bin/sh
# Installs what Alhazen is built and tested with, on Debian 12 or newer and on Ubuntu 24.04 or
# newer. Idempotent, and quick when nothing is missing.
#
#   scripts/setup.sh build   C compiler, libclang (for bindgen), Embree 4
#   scripts/setup.sh test    the same, the EXR tools that the tests read our files with (Python's OpenEXR
#                            package among them, in .python), and POV-Ray, with whose pictures they
#                            compare ours
#   scripts/setup.sh fuzz    C++ compiler, for libFuzzer (the fuzz targets need neither libclang nor Embree)
#
# Embree comes from, in this order: EMBREE_DIR, the project's own prefix (.embree), the system.
# Where the distribution's Embree is older than 4 (Debian 12), Debian 13's is unpacked into the
# prefix, together with the C library that it was built against; nothing else on the system changes.
set -eu
export LC_ALL=C # what apt prints is read below

stage=${1:-build}
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
prefix=$root/.embree

say() { printf 'setup: %s\n' "$*" >&2; }
die() { say "$*"; exit 1; }

as_root() {
    if [ "$(id -u)" -eq 0 ]; then "$@"
    elif command -v sudo >/dev/null 2>&1; then sudo "$@"
    else die "needs root (or sudo) to run: $*"
    fi
}

updated=
update_lists() {
    [ -n "$updated" ] || as_root apt-get update -qq
    updated=1
}

install_packages() {
    [ $# -gt 0 ] || return 0
    command -v apt-get >/dev/null 2>&1 ||
        die "please install by hand, as this is no Debian: $* (see README, Install)"
    say "installing $*"
    update_lists
    as_root env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}

has_embree_4() { [ -f "$1/include/embree4/rtcore.h" ]; }

# Unpacks Debian 13's Embree and everything that it loads into the prefix. apt is given lists, cache
# and status of its own, so it resolves the packages against an empty system and touches nothing;
# signatures are checked with the Debian keyring of this machine.
unpack_embree() {
    [ "$(dpkg --print-architecture)" = amd64 ] ||
        die "no Embree 4 for this architecture here; use --no-default-features"
    # shellcheck disable=SC1091  # a file of the system
    codename=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
    # shellcheck disable=SC2016  # apt's own variables
    uri=$(apt-get indextargets --format '$(REPO_URI)' \
        'Created-By: Packages' 'Component: main' "Codename: $codename" | head -n 1)
    [ -n "$uri" ] || die "found no Debian source among this machine's package sources"
    keyring=
    for k in /usr/share/keyrings/debian-archive-keyring.pgp /usr/share/keyrings/debian-archive-keyring.gpg; do
        [ -f "$k" ] && keyring=$k && break
    done
    [ -n "$keyring" ] || { install_packages debian-archive-keyring; keyring=$k; }

    say "unpacking Debian 13's Embree 4 into .embree"
    work=$root/.embree.part
    rm -rf "$work"
    trap 'rm -rf "$work"' EXIT
    mkdir -p "$work/apt/sources.list.d" "$work/apt/preferences.d" "$work/apt/lists/partial" \
        "$work/apt/cache/archives/partial" "$work/usr"
    printf 'Types: deb\nURIs: %s\nSuites: trixie\nComponents: main\nSigned-By: %s\n' \
        "$uri" "$keyring" > "$work/apt/sources.list.d/trixie.sources"
    # A merged /usr, as Debian's packages expect.
    for d in lib lib64 bin sbin; do mkdir -p "$work/usr/$d"; ln -s "usr/$d" "$work/$d"; done
    own_apt() {
        apt-get -qq -o Dir::Etc::sourcelist=/dev/null -o Dir::Etc::sourceparts="$work/apt/sources.list.d" \
            -o Dir::Etc::preferencesparts="$work/apt/preferences.d" -o Dir::State::lists="$work/apt/lists" \
            -o Dir::Cache="$work/apt/cache" -o Dir::State::status=/dev/null -o APT::Sandbox::User=root "$@"
    }
    own_apt update
    packages=$(own_apt -s install --no-install-recommends libembree-dev | awk '/^Inst /{print $2}')
    # shellcheck disable=SC2086  # a list of package names
    (cd "$work/apt/cache/archives" && own_apt download $packages)
    for deb in "$work"/apt/cache/archives/*.deb; do
        # tar follows the links of the merged /usr, where dpkg -x would replace them.
        dpkg-deb --fsys-tarfile "$deb" | tar -x --keep-directory-symlink -C "$work"
    done
    has_embree_4 "$work/usr" || die "the packages hold no include/embree4/rtcore.h"
    rm -rf "$work/apt" "$work/usr/share" "$prefix"
    mv "$work" "$prefix"
}

case $stage in build|test|fuzz) ;; *) die "unknown stage '$stage'; one of: build, test, fuzz" ;; esac

# --- fuzz ----------------------------------------------------------------------------------------
if [ "$stage" = fuzz ]; then
    command -v c++ >/dev/null 2>&1 || install_packages g++
    exit 0
fi

# --- build ---------------------------------------------------------------------------------------
missing=
command -v cc >/dev/null 2>&1 || missing="$missing gcc"
[ -f /usr/include/stdio.h ] || missing="$missing libc6-dev"
if [ -z "${LIBCLANG_PATH:-}" ]; then
    found=
    for f in /usr/lib/llvm-*/lib/libclang.so /usr/lib/llvm-*/lib/libclang.so.1 /usr/lib/*/libclang.so; do
        [ -e "$f" ] && found=1
    done
    [ -n "$found" ] || missing="$missing libclang-dev"
fi
# shellcheck disable=SC2086  # a list of package names
install_packages $missing

if [ -n "${EMBREE_DIR:-}" ]; then
    has_embree_4 "$EMBREE_DIR" || die "EMBREE_DIR=$EMBREE_DIR holds no include/embree4/rtcore.h"
elif ! has_embree_4 "$prefix/usr" && ! has_embree_4 /usr && ! has_embree_4 /usr/local; then
    command -v apt-cache >/dev/null 2>&1 ||
        die "please install Embree 4 and set EMBREE_DIR, or build with --no-default-features"
    update_lists
    case $(apt-cache policy libembree-dev | awk '/Candidate:/{print $2}') in
        4.*) install_packages libembree-dev ;;
        *) unpack_embree ;;
    esac
fi

# --- test ----------------------------------------------------------------------------------------
if [ "$stage" = test ]; then
    missing=
    command -v exrheader >/dev/null 2>&1 || missing="$missing openexr"
    command -v oiiotool >/dev/null 2>&1 || missing="$missing openimageio-tools"
    command -v povray >/dev/null 2>&1 || missing="$missing povray"
    # shellcheck disable=SC2086  # a list of package names
    install_packages $missing

    # Debian packages no Python bindings of OpenEXR; the Python Package Index does.
    python=$root/.python
    wanted=openexr-3.5.3
    if ! [ -f "$python/$wanted" ]; then
        /usr/bin/python3 -c 'import ensurepip, venv' 2>/dev/null || install_packages python3-venv
        say "installing Python's OpenEXR in .python"
        rm -rf "$python"
        if /usr/bin/python3 -m venv "$python" &&
            "$python/bin/pip" install -q --disable-pip-version-check --only-binary :all: \
                "OpenEXR==${wanted#openexr-}" numpy; then
            touch "$python/$wanted"
        else
            rm -rf "$python"
            say "could not; the tests of what it reads say that they did not run"
        fi
    fi
fi
