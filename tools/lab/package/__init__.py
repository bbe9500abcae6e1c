"""The Debian package: everything that a robot needs, in one file.

``tree.build`` lays out the files of the package: the program with its libraries
(``environment``), pages (``manual``), completion (``completion``), licences (``licences``) and
what stands in ``debian/``. ``archive.pack`` makes one ``.deb`` of them.
"""
