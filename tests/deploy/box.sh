#!/bin/bash
# systemd as PID 1 on an overlay, in namespaces of its own: nothing outside changes.
#
# usage: box.sh SHARE REPOSITORY PYTHON_PREFIX SITE_PACKAGES [TREE]
# The overlay is of this machine, with a program that runs the repository, or of TREE as it is.
# Runs SHARE/inside.sh as root in there and ends; SHARE is the only folder that both sides see.
set -eu
share=$1 repository=$2 python=$3 site=$4 tree=${5:-/}

if [ "${BOX:-}" = "" ]; then
    # a control group below ours, so that systemd's groups vanish with the box
    hierarchy=$(findmnt -n -o TARGET -t cgroup2 | head -n1)
    group=$hierarchy$(sed -n 's/^0:://p' /proc/self/cgroup)/drslamd-box-$$
    mkdir "$group"
    trap 'find "$group" -depth -type d -exec rmdir {} +' EXIT
    (
        echo "$BASHPID" >"$group/cgroup.procs"
        BOX=inside unshare --fork --pid --mount --net --uts --ipc --cgroup --kill-child "$0" "$@"
    )
    exit
fi

mount --make-rprivate /
scratch=$share/scratch root=$share/scratch/root
mkdir -p "$scratch"
mount -t tmpfs box "$scratch"
mkdir -p "$scratch/upper" "$scratch/work" "$root"
mount -t overlay box -o "lowerdir=$tree,upperdir=$scratch/upper,workdir=$scratch/work" "$root"

# the service sees no home and no /tmp, where a Python under test may live
for folder in share repository python site; do
    mkdir -p "$root/box/$folder"
    mount --bind "${!folder}" "$root/box/$folder"
done
if [ "$tree" = / ]; then
    mkdir -p "$root/opt/drslamd/bin"
    cat >"$root/opt/drslamd/bin/drslamd" <<'PROGRAM'
#!/bin/sh
PYTHONPATH=/box/repository:/box/site PYTHONDONTWRITEBYTECODE=1 exec /box/python/bin/python3 -m drslamd "$@"
PROGRAM
    chmod 755 "$root/opt/drslamd/bin/drslamd"
    ln -s /opt/drslamd/bin/drslamd "$root/usr/local/bin/drslamd"
fi

cat >"$root/etc/systemd/system/box.target" <<'UNIT'
[Unit]
Wants=box.service systemd-journald.service
UNIT
cat >"$root/etc/systemd/system/box.service" <<'UNIT'
[Unit]
After=systemd-journald.service
[Service]
Type=oneshot
WorkingDirectory=/box/repository
ExecStart=/bin/bash /box/share/inside.sh
ExecStopPost=/bin/systemctl exit 0 --force
TimeoutStartSec=120
StandardOutput=append:/box/share/inside.log
StandardError=append:/box/share/inside.log
UNIT

mount -t proc proc "$root/proc"
mount -t sysfs sysfs "$root/sys" -o ro # writable, it would promise an udev that is not there
mount -t cgroup2 cgroup2 "$root/sys/fs/cgroup"
mount -t tmpfs run "$root/run" -o mode=755
mount -t tmpfs dev "$root/dev" -o mode=755
mkdir -p "$root/dev/pts" "$root/dev/shm" "$root/dev/net"
mount -t devpts devpts "$root/dev/pts" -o newinstance,ptmxmode=0666,gid=5
mount -t tmpfs shm "$root/dev/shm"
ln -s pts/ptmx "$root/dev/ptmx"
ln -s /proc/self/fd "$root/dev/fd"
while read -r name major minor; do
    mknod -m 666 "$root/dev/$name" c "$major" "$minor"
done <<'NODES'
null 1 3
zero 1 5
full 1 7
random 1 8
urandom 1 9
kmsg 1 11
tty 5 0
ttyS0 4 64
net/tun 10 200
NODES
ip link set lo up

cd "$root"
mkdir outside
pivot_root . outside
umount -l /outside
exec env -i container=box PATH=/usr/sbin:/usr/bin:/sbin:/bin \
    /lib/systemd/systemd --system --unit=box.target --show-status=no --log-target=console \
    >/box/share/systemd.log 2>&1 </dev/null
