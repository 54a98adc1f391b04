#!/usr/bin/env bash
# Makes the two base images of the Dockerfile from Debian's packages and the installed Rust toolchain, for machines that
# reach a Debian mirror but no image registry. Needs docker, debootstrap and root.
#
#   deploy/local-base.sh both|runtime|builder [SUITE [MIRROR]]
#   docker build -f deploy/Dockerfile -t kittiwake --build-arg BUILDER=kittiwake-local-builder \
#       --build-arg RUNTIME=kittiwake-local-runtime .
#
# The builder also trusts the certificate authorities of this machine, so that cargo reaches the crate registry from inside
# as it does from outside. They are not in the shipped image: only the program is copied from the builder.
set -euo pipefail
which=${1:-both}
suite=${2:-trixie}
mirror=${3:-http://deb.debian.org/debian}

for tool in docker debootstrap rustc; do
    command -v "$tool" >/dev/null || { echo "local-base.sh: \`$tool\` is not installed" >&2; exit 2; }
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

if [ "$which" != builder ]; then
    echo "runtime: Debian $suite, minimal" >&2
    debootstrap --variant=minbase "$suite" "$work/runtime" "$mirror" >"$work/log" ||
        { tail -n 20 "$work/log" >&2; exit 1; }
    rm -rf "$work"/runtime/var/cache/apt/* "$work"/runtime/var/lib/apt/lists/* "$work"/runtime/var/log/* \
        "$work"/runtime/usr/share/{doc,man,info,locale,lintian}/*
    tar -C "$work/runtime" -c . | docker import - kittiwake-local-runtime >/dev/null
fi

if [ "$which" != runtime ]; then
    echo "builder: the same with a C linker and $(rustc --version)" >&2
    debootstrap --variant=minbase --include=gcc,libc6-dev,ca-certificates "$suite" "$work/builder" "$mirror" \
        >"$work/log" || { tail -n 20 "$work/log" >&2; exit 1; }
    mkdir -p "$work/builder/usr/local/rust"
    cp -a "$(rustc --print sysroot)/." "$work/builder/usr/local/rust/"
    rm -rf "$work/builder/usr/local/rust/share/doc"
    cp /etc/ssl/certs/ca-certificates.crt "$work/builder/etc/ssl/certs/ca-certificates.crt"
    tar -C "$work/builder" -c . | docker import \
        --change 'ENV PATH=/usr/local/rust/bin:/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin' \
        - kittiwake-local-builder >/dev/null
fi

docker images --format '{{.Repository}}  {{.Size}}' 'kittiwake-local-*' >&2
