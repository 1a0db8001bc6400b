"""Neovim with the lines of the how-to page: it attaches, shows diagnostics and completes."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NVIM = shutil.which("nvim", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
TEXT = "machine m\n\ninitial a\n\nstate a\n    do rotat(90 deg)\n    when space.l\n\nfinal b\n"
DRIVE = """
local function until_true(condition) assert(vim.wait(30000, condition, 20), "nothing came") end
vim.cmd.edit("m.maze-machine")
until_true(function() return #vim.lsp.get_clients({ bufnr = 0 }) == 1 end)
until_true(function() return #vim.diagnostic.get(0) > 0 end)
local codes = vim.tbl_map(function(one) return one.code end, vim.diagnostic.get(0))
local params = { textDocument = vim.lsp.util.make_text_document_params(0), position = { line = 6, character = 16 } }
local found = vim.lsp.buf_request_sync(0, "textDocument/completion", params, 20000)
local labels = {}
for _, answer in pairs(found) do
  for _, item in ipairs(answer.result.items or answer.result) do table.insert(labels, item.label) end
end
local client = vim.lsp.get_clients({ bufnr = 0 })[1]
local colours = client.server_capabilities.semanticTokensProvider ~= nil
io.stdout:write(vim.json.encode({ codes = codes, labels = labels, colours = colours }))
vim.cmd("qall!")
"""


@pytest.mark.skipif(NVIM is None, reason="Neovim is not installed")
def test_neovim_attaches_and_asks(tmp_path):
    page = (ROOT / "docs" / "how-to" / "editor.md").read_text(encoding="utf-8")
    (lines,) = re.findall(r"^```lua\n(.*?)^```$", page, re.DOTALL | re.MULTILINE)
    (tmp_path / "init.lua").write_text(lines, encoding="utf-8")
    (tmp_path / "drive.lua").write_text(DRIVE, encoding="utf-8")
    (tmp_path / "m.maze-machine").write_text(TEXT, encoding="utf-8")
    (tmp_path / "maze-machine.toml").write_text("", encoding="utf-8")
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "HOME": str(tmp_path),
        "XDG_CONFIG_HOME": str(tmp_path / "configuration"),
        "XDG_STATE_HOME": str(tmp_path / "state"),
        "XDG_DATA_HOME": str(tmp_path / "data"),
    }
    done = subprocess.run(
        [NVIM, "--headless", "-u", "init.lua", "-l", "drive.lua"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=90,
        check=False,
    )
    shown = json.loads(done.stdout or done.stderr)
    assert "E0204" in shown["codes"]
    assert shown["labels"] == ["space.left"]
    assert shown["colours"] is True
