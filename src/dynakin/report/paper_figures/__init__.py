"""The paper's figures for any run, as files for papers."""
