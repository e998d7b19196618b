#!/usr/bin/env bash
# A C compiler for the PIC18F4550: prints the folder that holds bin/sdcc, and builds it first where
# it is missing. Debian's own sdcc leaves this port out, so it is made of Debian's source package,
# once, in a cache outside the tree (POLEPILOT_CACHE, or the user's cache folder). Nothing of it
# comes into the repository, nothing outside the cache is changed, and root is not needed.
#
#   sdcc-pic16.sh           build if missing, print the folder
#   sdcc-pic16.sh --where   print the folder, present or not
#   sdcc-pic16.sh --needs   the Debian packages without which it cannot be built
#
# Where another release or distribution has an sdcc with this port and its library, SDCC_PIC16 may
# name its folder (bin/sdcc, include/pic16, lib/crt0iz.o, lib/libsdcc.lib) instead.
set -euo pipefail

NEEDS="gcc g++ make bison flex libboost-dev zlib1g-dev dpkg-dev gputils"
PORTS="mcs51 z80 z180 r2k r2ka r3ka sm83 tlcs90 ez80_z80 z80n ds390 ds400 pic14 hc08 s08 stm8 pdk13
    pdk14 pdk15 mos6502"

fail() { echo "sdcc-pic16.sh: $*" >&2; exit 1; }

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
# The key: how it is built, and on what.
key=$({ sed '/^#/d' "$here/sdcc-pic16.sh"; cat /etc/os-release; uname -m; } | sha256sum | cut -c1-16)
place=${SDCC_PIC16:-${POLEPILOT_CACHE:-${XDG_CACHE_HOME:-$HOME/.cache}/polepilot}/sdcc-pic16-$key}

case "${1-}" in
    --needs) echo "$NEEDS"; exit ;;
    --where) echo "$place"; exit ;;
    "") ;;
    *) fail "usage: sdcc-pic16.sh [--where | --needs]" ;;
esac

if [ -f "$place/complete" ] || [ -n "${SDCC_PIC16-}" ]; then
    echo "$place"
    exit
fi

mkdir -p "$(dirname "$place")"
exec 9>"$place.lock" # two at once: the second waits and finds it done
flock 9
if [ -f "$place/complete" ]; then
    echo "$place"
    exit
fi
command -v apt-get >/dev/null || fail "needs Debian's apt-get (or SDCC_PIC16)"
for tool in gcc g++ make bison flex dpkg-source gpasm gplib; do
    command -v "$tool" >/dev/null || fail "$tool is missing: apt-get install $NEEDS"
done

work=$(mktemp -d "$place.XXXXXX")
log=$place.log
trap 'rm -rf "$work"' EXIT

fetch() { # the source package of this very release, without touching the machine's apt
    local uri suite component
    mkdir -p "$work/apt/lists/partial" "$work/apt/archives/partial" "$work/src"
    # The same places that the machine has its binary packages from.
    while IFS='|' read -r uri suite component; do
        echo "deb-src $uri $suite $component"
    done < <(apt-get indextargets --format '$(REPO_URI)|$(CODENAME)|$(COMPONENT)' \
        'Created-By: Packages' 'Origin: Debian' 'Component: main' | sort -u) >"$work/apt/sources.list"
    [ -s "$work/apt/sources.list" ] || fail "apt-get knows no source of Debian (run apt-get update)"
    local options=(
        -qq -o "Dir::Etc::SourceList=$work/apt/sources.list" -o Dir::Etc::SourceParts=/dev/null
        -o "Dir::State::Lists=$work/apt/lists" -o "Dir::Cache::Archives=$work/apt/archives"
        -o Dir::Cache::pkgcache= -o Dir::Cache::srcpkgcache= -o "APT::Sandbox::User=$(id -un)"
        -o Acquire::Retries=3
    )
    apt-get "${options[@]}" update
    (cd "$work/src" && apt-get "${options[@]}" source sdcc)
}

build() {
    local tree port cflags="-O1 -g0 -w"
    tree=$(echo "$work"/src/sdcc-*/)
    cd "$tree"
    # shellcheck disable=SC2046 # one word for each port
    ./configure --disable-non-free --disable-ucsim --disable-sdcdb --disable-sdbinutils \
        --disable-packihx --disable-device-lib \
        $(for port in $PORTS; do echo "--disable-$port-port"; done) \
        CFLAGS="$cflags" CXXFLAGS="$cflags"
    make -j"$(nproc)" -C support/cpp CFLAGS="$cflags"
    make -j"$(nproc)" -C src
    mkdir -p "$work/out/bin" "$work/out/include/asm" "$work/out/lib"
    cp bin/sdcc bin/sdcpp "$work/out/bin"
    cp -r device/include/pic16 "$work/out/include"
    cp -r device/include/asm/pic16 "$work/out/include/asm"
    cp COPYING "$work/out"
}

library() { # what the compiler calls: products, quotients, generic pointers, the start, the stack
    local out=$work/out file name
    local flags=(-mpic16 -p18f4550 --std-c11 --nostdinc --no-warn-non-free "-I$out/include/pic16"
        --fomit-frame-pointer --obanksel=9 --denable-peeps --optimize-cmp --optimize-df)
    cd "$(echo "$work"/src/sdcc-*/device/lib/pic16)"
    mkdir -p "$work/obj"
    for file in libsdcc/{char,int,long,lregs}/*.c libsdcc/gptr/gptr*.c; do
        name=$(basename "$file" .c)
        "$out/bin/sdcc" "${flags[@]}" -c "$file" -o "$work/obj/$name.o"
    done
    "$out/bin/sdcc" "${flags[@]}" -c startup/crt0iz.c -o "$out/lib/crt0iz.o"
    gpasm -q -c -p18f4550 -o "$work/obj/stack.o" libsdcc/stack/stack.S
    gplib -c "$out/lib/libsdcc.lib" "$work"/obj/*.o
}

(fetch; build; library) >"$log" 2>&1 & # as a job, so that the first failure ends it
if ! wait $!; then
    tail -25 "$log" >&2
    fail "it was not built; the whole story is in $log"
fi
[ -s "$work/out/lib/libsdcc.lib" ] || fail "no library came out; see $log"
touch "$work/out/complete"
rm -rf "$place"
mv "$work/out" "$place"
echo "$place"
