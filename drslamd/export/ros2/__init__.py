"""ROS 2 messages in MCAP files, without ROS: definitions, their bytes, and what is said in them."""
