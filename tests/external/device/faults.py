"""What can be wrong with the independent keypad: a name for each fault, and what it does."""

from __future__ import annotations

FAULTS = {
    # commissioning
    "echo-slow": "the echo comes every 115 ms",
    "echo-alive": "heartbeats go on while it echoes",
    "service-rate": "commissioning runs at the stored bit rate, not at 125 kbit/s",
    "service-one-key": "one of the two keys is enough for commissioning",
    "service-boot": "a boot-up is sent before it waits for parameters",
    "heartbeat-swapped": "the heartbeat time is read low byte first",
    "heartbeat-signed": "heartbeat times from 32768 ms on are taken for none",
    "code-five": "bit-rate code 5 is read as 100 kbit/s",
    "code-default": "unknown bit-rate codes keep the old rate",
    "id-three-bits": "only three bits of the node id are stored",
    "debounce-tens": "the debounce time is counted in steps of 10 ms",
    "store-slow": "parameters are stored two seconds after the first echo",
    "sync-in-echo": "the echo has 0 in the place of the sync time",
    # start
    "boot-twice": "boot-up is sent twice",
    "emcy-first": "EMCY comes before boot-up",
    "emcy-swapped": "the error code of EMCY is sent high byte first",
    "emcy-none": "no EMCY after boot-up",
    "autostart": "after power-on it becomes operational by itself",
    # NMT
    "nmt-all": "commands to all nodes are not obeyed",
    "nmt-low-bits": "only four bits of the node id in a command are compared",
    "nmt-stop-start": "from stopped, no command is obeyed",
    "nmt-long": "an NMT frame of 3 bytes for another node is obeyed",
    "nmt-reset-quiet": "reset communication leads to pre-operational without boot-up",
    "nmt-reset-memory": "reset node brings back the factory heartbeat time",
    # heartbeat
    "heartbeat-toggle": "bit 7 of the heartbeat toggles",
    "heartbeat-key": "each key frame restarts the heartbeat period",
    "heartbeat-led": "each LED frame puts the next heartbeat off by 20 ms",
    "heartbeat-fast": "the heartbeat runs 3 % fast",
    "heartbeat-stale": "the first heartbeat after a command shows the old state",
    "heartbeat-zero": "period 0 is read as 1 s",
    # keys
    "keys-reversed": "bits of the key frame are in reverse order",
    "keys-release": "releases are reported without debounce",
    "keys-shared": "one debounce timer serves all keys",
    "keys-entry": "no key frame when it becomes operational",
    "keys-pre": "key frames are sent in pre-operational, too",
    "keys-latch": "a debounced press is reported once more after 300 ms",
    "keys-bounce": "the debounce time runs from the first edge",
    "keys-backlog": "changes while stopped are sent one by one at entry",
    # LEDs
    "leds-coupled": "writing the steady map clears the blink map",
    "leds-pre": "LED frames act in pre-operational, too",
    "leds-blink-wins": "where both bits are set the LED blinks",
    "leds-or": "LED bits are only ever added",
    "leds-short": "a frame without data switches all LEDs off",
    # robustness
    "crash-empty": "an LED frame without data restarts it",
    "extended": "extended frames are taken for base frames",
    "param-open": "the commissioning frame is obeyed in operational, too",
    "remote-answers": "a remote frame of its key frame is answered in every state",
    "load-late": "each frame from the bus puts the next heartbeat off by 1 ms",
    "sdo-echo": "it answers SDO requests while it echoes",
}
