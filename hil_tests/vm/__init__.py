"""Runs a command where SocketCAN exists: on this kernel, or in a machine with virtual time.

`nodeproof vcan -- COMMAND` looks first whether this kernel has the channel (`native`). Where it
has not (containers, WSL, kernels without the vcan module) the command runs in a QEMU machine that
boots a stock kernel on this very file system (`kernel`, `initramfs`, `guest`, `machine`), driven
by `launcher`. `command` is the face that users see.

The machine's processor counts instructions and its clock follows that count (`-icount`), so the
guest's time does not depend on how busy the host is, and time in which every process waits is
skipped: a minute of sleep costs next to nothing.

Only the standard library is used, and of the host no more than QEMU, a kernel and a static
busybox; none of them has to be installed by root except QEMU.
"""
