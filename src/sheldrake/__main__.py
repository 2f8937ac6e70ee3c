"""`python -m sheldrake`: the same as the command `sheldrake`."""

from sheldrake.cli import main

raise SystemExit(main())
