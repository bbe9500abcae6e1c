"""What is wrong with a robot, why, and what to do about it.

`diagnosis` looks at every stage, from the sensors to the pose; `contradictions` has the sentences
for measurements that contradict each other; `health` remembers what was said and logs what changes.
"""
