#!/usr/bin/env bash
# An authority of your own and a folder for each process of a run: its certificate, its key, its configuration.
#
#     make-certificates.sh FOLDER HOST NAME...
#
# HOST is the name or address under which the others reach the process that listens; its folder is FOLDER/hub. Each NAME
# is that of a node, or `coordinator` for one behind a router. Run again with further names, it adds them.
set -euo pipefail

if [ $# -lt 3 ]; then
  echo "usage: make-certificates.sh FOLDER HOST NAME..." >&2
  exit 2
fi
folder=$1 host=$2
shift 2
here=$(cd "$(dirname "$0")" && pwd)
days=365
umask 077
mkdir -p "$folder"
cd "$folder"

key() { openssl ecparam -name prime256v1 -genkey -noout -out "$1"; }

# The authority. Its key stays here: whoever has it makes members.
if [ ! -e ca.key ]; then
  key ca.key
  openssl req -x509 -new -sha256 -key ca.key -days "$days" -subj "/CN=stagger authority" \
    -addext "basicConstraints=critical,CA:TRUE" -addext "keyUsage=critical,keyCertSign" -out ca.crt
fi

# member NAME USAGE EXTENSIONS CONFIGURATION
member() {
  [ -e "$1" ] && return
  mkdir "$1"
  key "$1/own.key"
  openssl req -new -sha256 -key "$1/own.key" -subj "/CN=$1" -out "$1/own.csr"
  printf 'basicConstraints=CA:FALSE\nextendedKeyUsage=%s\n%s\n' "$2" "$3" > "$1/extensions"
  openssl x509 -req -sha256 -in "$1/own.csr" -CA ca.crt -CAkey ca.key -CAcreateserial -days "$days" \
    -extfile "$1/extensions" -out "$1/own.crt" 2> "$1/log" || { cat "$1/log" >&2; exit 1; }
  rm "$1/own.csr" "$1/extensions" "$1/log"
  cp ca.crt "$1/"
  cp "$here/$4" "$1/zenoh.json5"
}

case $host in
  *[!0-9.]*) alternative=DNS:$host ;;
  *) alternative=IP:$host ;;
esac
member hub serverAuth "subjectAltName=$alternative" hub.json5
for name in "$@"; do
  # A node's certificate is no good for listening: nobody can pass for the hub.
  member "$name" clientAuth "" member.json5
done
