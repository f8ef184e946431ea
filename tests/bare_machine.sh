#!/usr/bin/env bash
# Run `make demo` and `make test` on a machine that has python3.11, make, git and package registries, and nothing else.
#
#   tests/bare_machine.sh                   # as root: make demo, then make test
#   tests/bare_machine.sh make lint         # another command
#
# The machine is a folder with a minimal Debian in it, and namespaces of its own. It has this machine's settings of apt,
# pip and certificates, and sees the folders of packages that those name. What is committed here is cloned into it.
# BARE_MACHINE=FOLDER keeps the machine in a folder, and takes one that is there; without it, it is removed at the end.
set -euo pipefail

fail() { echo "$0: $*" >&2; exit 1; }

[ "$(id -u)" = 0 ] || fail "needs root, to make a machine in a folder; run it with sudo"
for tool in apt-get debootstrap git unshare; do
    command -v "$tool" >/dev/null || fail "needs $tool; on Debian: apt-get install debootstrap git util-linux"
done
repository=$(git -C "$(dirname "$0")" rev-parse --show-toplevel)
root=${BARE_MACHINE:-$(mktemp -d /var/tmp/bare-machine-XXXXXX)}
[ -n "${BARE_MACHINE:-}" ] || trap 'rm -rf --one-file-system "$root"' EXIT

environment=()  # where pip finds packages, and by which certificates and proxies; nothing else of this one
while IFS= read -r line; do environment+=("$line"); done < <(env | grep -iE '^(PIP_[A-Z_]*|[A-Z_]*CERT[A-Z_]*|[A-Z_]*_CA[A-Z_]*|[A-Z]*_PROXY)=')
settings() { cat /etc/pip.conf ~/.pip/pip.conf ~/.config/pip/pip.conf 2>/dev/null; printf '%s\n' "${environment[@]}"; }
packages() {  # the folders of packages that the settings of pip name
    (settings || true) | grep -oE '(^|[ =:])(file://)?/[^ :=]+' | sed -E 's,^[ =:]*(file://)?,,; s,/simple/?$,,' | grep -v '^/etc/' | sort -u
}

make_machine() {
    mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' | head -1)
    [ -n "$mirror" ] || fail "apt knows no mirror: check /etc/apt/sources.list"
    mkdir -p "$root"
    echo "Making a machine in $root"
    (. /etc/os-release && debootstrap --variant=minbase "$VERSION_CODENAME" "$root" "$mirror") >"$root.log" 2>&1 ||
        fail "debootstrap failed; $root.log says why"
    chmod 755 "$root"
    rm "$root/etc/apt/sources.list"
    copy /etc/apt /etc/resolv.conf /etc/hosts /etc/pip.conf ~/.pip ~/.config/pip
    chroot "$root" sh -c 'apt-get update && apt-get install --yes --no-install-recommends \
        python3.11 python3.11-venv make git ca-certificates' >>"$root.log" 2>&1 || fail "apt-get failed; $root.log says why"
    copy /usr/local/share/ca-certificates
    chroot "$root" update-ca-certificates >>"$root.log" 2>&1
    for path in $(packages); do mkdir -p "$root$path"; done
}

copy() {
    for path in "$@"; do
        if [ -e "$path" ]; then mkdir -p "$root$(dirname "$path")"; cp -rLT --remove-destination "$path" "$root$path"; fi
    done
}

run() {
    echo "On the bare machine: $*"
    unshare --mount --pid --ipc --fork bash -euc '
        root=$1; shift
        mount -t proc proc "$root/proc"
        mount --rbind /dev "$root/dev"
        mount -t tmpfs tmpfs "$root/dev/shm"
        while [ "$1" != -- ]; do mount --bind -o ro "$1" "$root$1"; shift; done; shift
        exec chroot "$root" env -i HOME=/root PATH=/usr/local/bin:/usr/bin:/bin "$@"
    ' - "$root" $(packages) -- "${environment[@]}" sh -c 'cd ~/gaplab && exec "$@"' - "$@"
}

[ -e "$root/usr/bin/make" ] || make_machine
rm -rf "$root/root/gaplab"
git clone --quiet --no-hardlinks "$repository" "$root/root/gaplab"
if [ $# -gt 0 ]; then
    run "$@"
else
    run make demo
    run make test
fi
