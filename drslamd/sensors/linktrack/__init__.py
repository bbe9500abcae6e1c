"""Nooploop LinkTrack modules: bytes become ranges. Entry: `linktrack_input.LinkTrackInput.feed`."""
