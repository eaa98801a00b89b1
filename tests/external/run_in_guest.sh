#!/bin/bash
# A device of one's own on vcan0, and the suite against it: one command for the virtual machine.
#
#   run_in_guest.sh BENCH REPORTS DEVICE... -- PYTEST...
#
# DEVICE... is the command that starts the device, which serves the control protocol at
# tcp:127.0.0.1:5555 and is ready as soon as that port takes connections. PYTEST... is passed on.
set -u
bench=$1 reports=$2
shift 2
device=()
while [ "$1" != -- ]; do
    device+=("$1")
    shift
done
shift

log=$reports/device.log
mkdir -p "$reports"
"${device[@]}" >"$log" 2>&1 &
device_id=$!
trap 'kill "$device_id" 2>/dev/null; wait "$device_id"' EXIT

until (: <>/dev/tcp/127.0.0.1/5555) 2>/dev/null; do
    if ! kill -0 "$device_id" 2>/dev/null; then
        echo "the device ended before it was ready:" >&2
        cat "$log" >&2
        exit 11
    fi
    sleep 0.05
done

cd "$(dirname "$0")/../.." || exit 11
"${PYTHON:-python3}" -m pytest -p no:cacheprovider --can-iface=vcan0 --can-device=external \
    "--can-bench=$bench" "--can-reports=$reports" "$@"
