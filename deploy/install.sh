#!/bin/sh
# Install Polepilot as a service on Debian, Raspberry Pi OS or Ubuntu. May be run again: it brings
# the program up to date and leaves the configuration and all data as they are.
#
#   sudo deploy/install.sh              install and start
#   sudo deploy/install.sh --no-start   install only
#   sudo deploy/install.sh --uninstall  remove program and service; configuration and data stay
#   deploy/install.sh --root DIR        lay the files out below DIR and touch nothing else
#
# PYTHON names another interpreter, 3.11 or newer.
set -eu

here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
source=$(dirname -- "$here")
python=${PYTHON:-python3}
root=
start=yes
uninstall=no

say() { printf '%s\n' "$*"; }
fail() { printf 'install.sh: %s\n' "$*" >&2; exit "${2:-1}"; }

while [ $# -gt 0 ]; do
    case $1 in
        --no-start) start=no ;;
        --uninstall) uninstall=yes ;;
        --root)
            [ $# -ge 2 ] || fail "--root needs a folder"
            root=$2
            shift
            ;;
        -h | --help)
            sed -n '2,10s/^# \{0,1\}//p' "$0"
            exit 0
            ;;
        *)
            printf 'install.sh: unknown option %s, see --help\n' "$1" >&2
            exit 2
            ;;
    esac
    shift
done

if [ -z "$root" ] && [ "$(id -u)" != 0 ]; then
    fail "run it with sudo: it makes a user and a service"
fi

if [ "$uninstall" = yes ]; then
    if [ -z "$root" ]; then
        systemctl disable --now polepilot.service 2>/dev/null || true
    fi
    rm -rf "$root/opt/polepilot"
    rm -f "$root/etc/systemd/system/polepilot.service" "$root/etc/udev/rules.d/99-polepilot.rules"
    if [ -z "$root" ]; then
        systemctl daemon-reload
        udevadm control --reload || true
    fi
    say "Removed. Configuration stays in $root/etc/polepilot, data in $root/var/lib/polepilot."
    exit 0
fi

"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null ||
    fail "needs Python 3.11 or newer; $python is not. Set PYTHON to one that is."
"$python" -c 'import ensurepip' 2>/dev/null ||
    fail "Python's venv is missing: sudo apt install python3-venv"

if [ -z "$root" ]; then
    if ! getent passwd polepilot >/dev/null; then
        say "Making the user polepilot"
        useradd --system --user-group --home-dir /var/lib/polepilot --no-create-home \
            --shell /usr/sbin/nologin polepilot
    fi
    for group in dialout video; do
        if getent group "$group" >/dev/null; then
            usermod -aG "$group" polepilot
        fi
    done
fi

say "Installing the program into $root/opt/polepilot"
mkdir -p "$root/opt/polepilot"
venv=$root/opt/polepilot/venv
# An interpreter that was upgraded or removed leaves a venv behind that cannot start.
if ! "$venv/bin/python" -c '' 2>/dev/null; then
    rm -rf "$venv"
    "$python" -m venv "$venv"
fi
"$venv/bin/python" -m pip install --quiet --upgrade --disable-pip-version-check "$source"
"$venv/bin/polepilot" --help >/dev/null || fail "the program was installed but does not start"

say "Installing configuration, service and udev rule"
mkdir -p "$root/etc/polepilot" "$root/etc/systemd/system" "$root/etc/udev/rules.d"
if [ ! -e "$root/etc/polepilot/robot.toml" ]; then
    cp "$source/robot.example.toml" "$root/etc/polepilot/robot.toml"
    chmod 0644 "$root/etc/polepilot/robot.toml"
fi
cp "$here/polepilot.service" "$root/etc/systemd/system/polepilot.service"
cp "$here/99-polepilot.rules" "$root/etc/udev/rules.d/99-polepilot.rules"
chmod 0644 "$root/etc/systemd/system/polepilot.service" \
    "$root/etc/udev/rules.d/99-polepilot.rules"

if [ -n "$root" ]; then
    say "Laid out below $root."
    exit 0
fi

udevadm control --reload || true
udevadm trigger --subsystem-match=tty || true
systemctl daemon-reload
systemctl enable --quiet polepilot.service
if [ "$start" = yes ]; then
    systemctl restart polepilot.service
    # A configuration that is refused ends the service at once; say so here, not in a log.
    sleep 2
    if ! systemctl --quiet is-active polepilot.service; then
        journalctl --unit polepilot.service --lines 5 --no-pager --output cat >&2 || true
        fail "the service does not run, see above"
    fi
fi
say "Done. Configuration: /etc/polepilot/robot.toml   Log: journalctl -u polepilot"
say "From your computer: ssh -L 8000:127.0.0.1:8000 $(hostname)   then http://localhost:8000"
