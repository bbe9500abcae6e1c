"""Any event that can enter a robot, and effects that can leave it, drawn by hypothesis."""

from __future__ import annotations

from hypothesis import strategies as st

from drslamd.events import (
    CanFrame,
    ChannelMessage,
    Datagram,
    Event,
    JobDone,
    Level,
    NetworkState,
    Note,
    PortCondition,
    PortState,
    Restart,
    Save,
    SaveDone,
    Send,
    SerialData,
    Slept,
    Stop,
    Tick,
)
from drslamd.gossip import lc02

utimes = st.integers(0, 2**62)
ports = st.sampled_from(["uwb", "wheels"])
words = st.text(max_size=20)
blobs = st.binary(max_size=40)
channels = st.sampled_from(["DRSLAM_STATUS_001", "DRSLAM_GRAPH_003", "OTHER", "REC_TICK_003"])
framed = st.builds(lc02.encode, st.just(0), channels, blobs)

datagrams = st.builds(Datagram, utimes, framed | blobs, words)
messages = st.builds(ChannelMessage, utimes, channels | words, blobs, words)
events: st.SearchStrategy[Event] = st.one_of(
    st.builds(SerialData, utimes, ports, blobs),
    st.builds(CanFrame, utimes, st.integers(0, 2**29 - 1), st.booleans(), st.binary(max_size=64)),
    st.builds(PortState, utimes, ports, st.sampled_from(PortCondition), words),
    datagrams,
    messages,
    st.builds(NetworkState, utimes, st.booleans(), words),
    st.builds(Tick, utimes),
    st.builds(Slept, utimes, utimes),
    st.builds(JobDone, utimes, st.integers(0, 2**62), st.none(), st.integers(0, 2**62)),
    st.builds(SaveDone, utimes, words),
    st.builds(Stop, utimes),
)
sends = st.builds(Send, st.sampled_from(["DRSLAM_STATUS_003", "DRSLAM_GRAPH_003"]), blobs)
effects = st.one_of(
    sends,
    st.builds(Save, st.dictionaries(words, st.integers())),
    st.builds(Restart, st.integers(0, 2**62), words),
    st.builds(Note, st.sampled_from(Level), words, st.dictionaries(words, words)),
)
