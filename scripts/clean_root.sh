# shellcheck shell=bash
# SPDX-License-Identifier: Apache-2.0
#
# in_clean_root RELEASE PACKAGE,... HOOK...: makes a temporary root of a Debian or Ubuntu release with these packages, and
# runs the hooks of mmdebstrap in it. pip works in it with this computer's certificates.

in_clean_root() {
  local release=$1 packages=$2 mirror=http://deb.debian.org/debian areas=main
  local keys=debian-archive-keyring.gpg package=debian-archive-keyring
  shift 2
  case $release in
    jammy | noble)
      mirror=http://archive.ubuntu.com/ubuntu areas="main universe"
      keys=ubuntu-archive-keyring.gpg package="ubuntu-keyring (in Debian from release 13 on)"
      ;;
  esac
  if ! command -v mmdebstrap >/dev/null || [ ! -e "/usr/share/keyrings/$keys" ]; then
    echo "error: mmdebstrap or /usr/share/keyrings/$keys is missing" >&2
    echo "  fix: install the packages mmdebstrap and $package" >&2
    return 1
  fi
  local certificates=/etc/ssl/certs/ca-certificates.crt
  PIP_CERT=$certificates mmdebstrap --quiet --variant=apt --format=null --include="$packages" \
    --customize-hook="upload $certificates $certificates" "$@" \
    "$release" - "deb [signed-by=/usr/share/keyrings/$keys] $mirror $release $areas"
}
