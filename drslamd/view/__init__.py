"""The live map: ``drslamd view`` listens to the team and draws it in a browser.

`scene` is pure: decoded messages in, updates for the page out. `listener` hears the network and
sends nothing, `door` says who may ask for what, `server` hands out the page and its updates.
"""
