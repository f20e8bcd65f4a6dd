# shellcheck shell=bash
# SPDX-License-Identifier: Apache-2.0
#
# in_clean_root RELEASE PACKAGE,... HOOK...: makes a temporary root of a Debian or Ubuntu release with these packages, and
# runs the hooks of mmdebstrap in it. pip works in it with this computer's certificates.

in_clean_root() {
  local release=$1 packages=$2 mirror=http://deb.debian.org/debian keys=debian-archive-keyring.gpg areas=main
  shift 2
  case $release in
    noble) mirror=http://archive.ubuntu.com/ubuntu keys=ubuntu-archive-keyring.gpg areas="main universe" ;;
  esac
  if ! command -v mmdebstrap >/dev/null || [ ! -e "/usr/share/keyrings/$keys" ]; then
    echo "error: mmdebstrap or /usr/share/keyrings/$keys is missing" >&2
    echo "  fix: apt-get install mmdebstrap, and the package of the keys (${keys%.gpg})" >&2
    return 1
  fi
  local certificates=/etc/ssl/certs/ca-certificates.crt
  PIP_CERT=$certificates mmdebstrap --quiet --variant=apt --format=null --include="$packages" \
    --customize-hook="upload $certificates $certificates" "$@" \
    "$release" - "deb [signed-by=/usr/share/keyrings/$keys] $mirror $release $areas"
}
