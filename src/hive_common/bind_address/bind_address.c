/* SPDX-License-Identifier: BSD-3-Clause */
/* Has the servers of ROS listen at ROS_IP only.
 *
 * roscpp's XML-RPC server listens on all interfaces whatever ROS_IP says, so anybody on the network
 * could shut rosout down although everything runs on one machine. rospy and the master do the same
 * unless ROS_IP is a loopback address. setup/environment.bash preloads this library: a socket
 * that a program binds to all interfaces is bound to ROS_IP, if its port is left to Linux (0), as
 * ROS's nodes do, or is the master's. All other sockets stay as the program wants them, and so do
 * datagram sockets if ROS_IP is a loopback address: roscpp takes care of these, and a program that
 * asks a name server needs others.
 */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

static const char *const MASTER = "http://localhost:11311";

/* Whether a port is the master's, and the master is not called by a name that means loopback: who
 * names localhost and an interface in ROS_IP would not reach a master that listens there only. */
static int is_masters(unsigned port)
{
    const char *uri = getenv("ROS_MASTER_URI");
    if (uri == NULL || *uri == '\0')
        uri = MASTER;
    const char *ip = getenv("ROS_IP");
    const char *host = strstr(uri, "//");
    const char *colon = strrchr(uri, ':');
    if (host == NULL || colon == NULL || port != (unsigned)atoi(colon + 1))
        return 0;
    int is_local = !strncmp(host, "//localhost", 11) || !strncmp(host, "//127.", 6);
    return !is_local || !strncmp(ip, "127.", 4);
}

static int is_for_all(int socket, const struct sockaddr *address, socklen_t length, const char *ip)
{
    int kind = 0;
    socklen_t size = sizeof kind;
    const struct sockaddr_in *in = (const struct sockaddr_in *)address;
    return address != NULL && length >= sizeof *in && address->sa_family == AF_INET &&
           in->sin_addr.s_addr == htonl(INADDR_ANY) &&
           getsockopt(socket, SOL_SOCKET, SO_TYPE, &kind, &size) == 0 &&
           (kind == SOCK_STREAM || (kind == SOCK_DGRAM && strncmp(ip, "127.", 4)));
}

int bind(int socket, const struct sockaddr *address, socklen_t length)
{
    int (*real)(int, const struct sockaddr *, socklen_t) =
        (int (*)(int, const struct sockaddr *, socklen_t))dlsym(RTLD_NEXT, "bind");
    const char *ip = getenv("ROS_IP");
    struct sockaddr_in own;
    if (ip != NULL && is_for_all(socket, address, length, ip)) {
        memcpy(&own, address, sizeof own);
        unsigned port = ntohs(own.sin_port);
        if ((port == 0 || is_masters(port)) && inet_pton(AF_INET, ip, &own.sin_addr) == 1)
            return real(socket, (const struct sockaddr *)&own, sizeof own);
    }
    return real(socket, address, length);
}
