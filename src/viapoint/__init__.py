"""viapoint: a robot programming language with its compiler, virtual machine and motion kernel."""
