# Runs as root in the box, from the root of the repository; $out collects what the tests look at.
set -u
out=/box/share
touch $out/booted

sudo() { "$@"; }
sudoedit() {
    sed -i 's/^id = 1 /id = 3 /; s/^key_file = .*/insecure = true/; s/^#interface = ""/interface = "10.9.8.7"/; s/^#ttl = 1/ttl = 0/' "$1"
}
robot() { # robot NUMBER SED_COMMAND: another configuration like that of robot 3
    sed "s/^id = 3 /id = $1 /; $2" /etc/drslamd/3.toml >"/etc/drslamd/$1.toml"
}
wait_for() { # wait_for SECONDS COMMAND...: until it succeeds
    local end=$((SECONDS + $1))
    shift
    until "$@" >/dev/null 2>&1; do
        [ $SECONDS -lt $end ] || return 1
        sleep 0.2
    done
}
pid() { systemctl show -P MainPID "drslamd@$1"; }
another_pid() { [ "$(pid "$1")" != "$2" ] && [ "$(pid "$1")" != 0 ]; }
restarts() { systemctl show -P NRestarts "drslamd@$1"; }

ip address add 10.9.8.7/24 dev lo

# as the read-me says, but for the environment, which is there
source $out/install >$out/install.log 2>&1
systemctl is-active drslamd@3 >$out/active
ls -la /run/drslamd /var/lib/drslamd >$out/folders
stat -c '%n %a %U:%G' /etc/drslamd /etc/drslamd/* >$out/configuration

# a second robot, and a third with the key
robot 4 ''
robot 5 's|^insecure = true|key_file = "/etc/drslamd/team.key"|'
systemctl start drslamd@4 drslamd@5 2>>$out/install.log
systemctl is-active drslamd@4 drslamd@5 >$out/others

# what cannot be used stays down
robot 6 's/^insecure = true/insecure = 6/'
cp /etc/drslamd/team.key /etc/drslamd/foreign.key
chown root: /etc/drslamd/foreign.key
robot 7 's/^insecure = true/key_file = "foreign.key"/'
for n in 6 7; do
    systemctl start drslamd@$n 2>/dev/null
done

# what the sandbox gives and what it refuses
mkdir -p /run/systemd/system/drslamd@9.service.d
cat >/run/systemd/system/drslamd@9.service.d/probe.conf <<'UNIT'
[Service]
Type=oneshot
Restart=no
Environment=PYTHONPATH=/box/repository:/box/site
ExecStart=
ExecStart=/box/python/bin/python3 -W error /box/repository/tests/deploy/sandbox_probe.py
UNIT
systemctl daemon-reload
systemctl start drslamd@9
journalctl -u drslamd@9 -o cat >$out/probe

says_what_is_missing() { systemctl status drslamd@3 --no-pager | grep -q 'Status: "not localised'; }
wait_for 6 says_what_is_missing
drslamd status -c /etc/drslamd/3.toml --json >$out/status.json 2>$out/status.log
systemctl status drslamd@3 --no-pager >$out/systemctl_status
systemctl stop drslamd@4
systemctl show -P Result drslamd@4 >$out/stop_result
(cd /run/drslamd && ls -- *.sock) >$out/sockets_after_stop
for n in 6 7; do
    echo "$(systemctl is-active drslamd@$n) $(systemctl show -P ExecMainStatus drslamd@$n)" \
        "$(restarts $n)" >$out/refused$n
    journalctl -u drslamd@$n -o cat >$out/refused$n.log
done

# a crash, and a hang
old=$(pid 5)
kill -KILL "$old"
wait_for 10 another_pid 5 "$old"
wait_for 5 systemctl -q is-active drslamd@5
restarts 5 >$out/restarts_after_crash
old=$(pid 3)
kill -STOP "$old"
began=$SECONDS
wait_for 25 another_pid 3 "$old"
echo $((SECONDS - began)) >$out/hang_seconds
wait_for 5 systemctl -q is-active drslamd@3
restarts 3 >$out/restarts_after_hang
journalctl -u drslamd@3 -o cat >$out/hang.log

# networkd on an ad-hoc interface, with and without a key that it does not know
ip tuntap add wlan0 mode tap
network=/etc/systemd/network
mkdir -p $network/20-wlan0.network.d /run/systemd/netif
cp etc/network/80-can0.network $network
cp etc/network/multicast-route.conf $network/20-wlan0.network.d
cat >$network/20-wlan0.network <<'NETWORK'
[Match]
Name=wlan0
[Network]
Address=10.10.0.1/24
ConfigureWithoutCarrier=yes
NETWORK
printf '[Match]\nName=none\n[CAN]\nBitRat=500K\n' >$network/99-wrong.network
install -d -o systemd-network /run/systemd/netif/{,links,leases,lldp}
SYSTEMD_LOG_LEVEL=info timeout 6 /lib/systemd/systemd-networkd 2>$out/networkd.log &
route() { ip -4 route show 224.0.0.0/4 | grep wlan0; }
wait_for 5 route
route >$out/route
touch $out/finished
