#!/bin/sh
# size.sh ELF NAME FLASH RAM: how much of the chip is taken; fails above one half.
set -eu
set -- "$1" "$2" "$3" "$4" $(avr-size -A "$1" | awk '
    $1 == ".text" {flash += $2} $1 == ".data" {flash += $2; ram += $2}
    $1 == ".bss" || $1 == ".noinit" {ram += $2} END {print flash, ram}')
echo "$2: flash $5 of $3 bytes ($((100 * $5 / $3)) %), RAM $6 of $4 bytes ($((100 * $6 / $4)) %)"
[ $((2 * $5)) -le "$3" ] && [ $((2 * $6)) -le "$4" ] || { echo "$2: more than one half" >&2; exit 1; }
