#!/bin/sh
# size.sh ELF|MAP NAME FLASH RAM: how much of the chip is taken; fails above one half.
#
# RAM is what the program's variables take, for the PIC its stack as well.
set -eu
case $1 in
    *.map) # of gplink: sections with their sizes in hexadecimal
        sum() { total=0; while read -r size; do total=$((total + size)); done; echo "$total"; }
        sections() { awk -v place="$2" '/Program Memory Usage/ {exit} $4 == place {print $5, $3}' "$1"; }
        flash=$(sections "$1" program | awk '$2 !~ /^0x3/ {print $1}' | sum)
        ram=$(sections "$1" data | awk '{print $1}' | sum)
        ;;
    *)
        set -- "$@" $(avr-size -A "$1" | awk '
            $1 == ".text" {flash += $2} $1 == ".data" {flash += $2; ram += $2}
            $1 == ".bss" || $1 == ".noinit" {ram += $2} END {print flash, ram}')
        flash=$5 ram=$6
        ;;
esac
echo "$2: flash $flash of $3 bytes ($((100 * flash / $3)) %), RAM $ram of $4 bytes ($((100 * ram / $4)) %)"
[ $((2 * flash)) -le "$3" ] && [ $((2 * ram)) -le "$4" ] || { echo "$2: more than one half" >&2; exit 1; }
