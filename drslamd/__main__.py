from drslamd.cli import main

raise SystemExit(main())
