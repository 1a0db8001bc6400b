"""The requests of the protocol, each answered from ``hsm.dsl.lsp``'s own terms."""
