"""What the kernel shows of this host: users, network interfaces, devices."""
