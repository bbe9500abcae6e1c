# Runs as root in a box of a clean Debian 12; $out collects what the tests look at.
set -u
out=/box/share
touch $out/booted
cd $out
export DEBIAN_FRONTEND=noninteractive

sudo() { "$@"; }
sudoedit() {
    sed -i 's/^id = 1 /id = 3 /; s/^#interface = ""/interface = "10.9.8.7"/; s/^#ttl = 1/ttl = 0/' "$1"
}
wait_for() { # wait_for SECONDS COMMAND...: until it succeeds
    local end=$((SECONDS + $1))
    shift
    until "$@" >/dev/null 2>&1; do
        [ $SECONDS -lt $end ] || return 1
        sleep 0.2
    done
}
pid() { systemctl show -P MainPID drslamd@3; }

ip address add 10.9.8.7/24 dev lo

source $out/install >$out/install.log 2>&1
systemctl is-active drslamd@3 >$out/active
systemctl is-enabled drslamd@3 >$out/enabled
id drslamd >$out/user
stat -c '%n %a %U:%G' /etc/drslamd /etc/drslamd/* /var/lib/drslamd /run/drslamd /usr/bin/drslamd \
    /usr/lib/drslamd >$out/modes
drslamd --version >$out/version 2>&1
PYTHONPATH=$out/trap drslamd --version >$out/trapped 2>&1
systemd-analyze verify --man=no drslamd@3.service >$out/verify 2>&1
find /usr/lib/drslamd -name '*.pyc' | wc -l >$out/compiled
dpkg --verify drslamd >$out/changed_files
answers() { drslamd status -c /etc/drslamd/3.toml; }
wait_for 6 answers
drslamd status -c /etc/drslamd/3.toml --json >$out/status.json 2>$out/status.log

# every module that a configuration can call for, with warnings as errors
sed 's/^id = 3 /id = 4 /' /etc/drslamd/3.toml >/etc/drslamd/4.toml
runuser -u drslamd -- /usr/bin/python3 -IS -W error -c '
import sys
sys.path.insert(0, "/usr/lib/drslamd")
import can, cantools, lcm, numpy, pydantic, scipy.optimize, serial, structlog
print({module.__file__.rpartition("/drslamd/")[0] for module in (can, lcm, numpy, serial)})
' >$out/modules 2>&1

# an update, then the end
old=$(pid)
apt-get install -y --reinstall ./drslamd_*.deb >$out/update.log 2>&1
wait_for 5 systemctl -q is-active drslamd@3
echo "$old $(pid)" >$out/pids
apt-get purge -y drslamd >$out/purge.log 2>&1
systemctl is-active drslamd@3 >$out/active_after
ls -d /usr/lib/drslamd /var/lib/drslamd /usr/bin/drslamd /etc/drslamd/* \
    /etc/systemd/system/multi-user.target.wants/drslamd@3.service >$out/left 2>/dev/null
touch $out/finished
