/* Lets an unmodified canbusload (can-utils) measure frames from standard input.
 *
 * Preloaded into `canbusload -e any@1000000` it stands in for the CAN socket: standard
 * input holds a sequence of `struct can_frame`; each is handed out by read(), and the
 * program's own alarm handler is called after it, so that canbusload prints one line a
 * frame, with the exact length that its canframelen.c computes. No kernel support for CAN
 * is needed. Ends with the input.
 */
#define _GNU_SOURCE
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/select.h>
#include <sys/syscall.h>
#include <unistd.h>

#define SOCKET_FD 9
#define FRAME_BYTES 16

static void (*on_alarm)(int);
static char frames[FRAME_BYTES * 4096];
static long held, used;
static int pending;

int socket(int domain, int type, int protocol)
{
	(void)domain; (void)type; (void)protocol;
	return SOCKET_FD;
}

int bind(int fd, const void *address, unsigned length)
{
	(void)fd; (void)address; (void)length;
	return 0;
}

int ioctl(int fd, unsigned long request, ...)
{
	(void)fd; (void)request;
	return 0;
}

unsigned alarm(unsigned seconds)
{
	(void)seconds;
	return 0;
}

void (*signal(int number, void (*handler)(int)))(int)
{
	if (number == 14) /* SIGALRM */
		on_alarm = handler;
	return NULL;
}

int pselect(int count, fd_set *in, fd_set *out, fd_set *other, const struct timespec *timeout,
	    const sigset_t *mask)
{
	(void)count; (void)out; (void)other; (void)timeout; (void)mask;
	if (pending) {
		pending = 0;
		on_alarm(14);
	}
	FD_ZERO(in);
	FD_SET(SOCKET_FD, in);
	return 1;
}

ssize_t read(int fd, void *buffer, size_t size)
{
	(void)size;
	if (fd != SOCKET_FD)
		return syscall(SYS_read, fd, buffer, size);
	if (used == held) {
		used = held = 0;
		while (held < (long)sizeof(frames)) {
			long got = syscall(SYS_read, 0, frames + held, sizeof(frames) - held);
			if (got <= 0)
				break;
			held += got;
		}
		if (held < FRAME_BYTES) {
			fflush(stdout);
			_exit(held ? 3 : 0);
		}
	}
	__builtin_memcpy(buffer, frames + used, FRAME_BYTES);
	used += FRAME_BYTES;
	pending = 1;
	return FRAME_BYTES;
}
