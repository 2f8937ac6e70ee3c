"""The browser for these tests, and where their pictures go."""

import os
from pathlib import Path

import pytest
from chromium import Chromium, executable


def pytest_collection_modifyitems(items):
    for item in items:
        if "browser" in Path(item.fspath).parts:
            item.add_marker(pytest.mark.browser)


def start(**options):
    if executable() is None:
        pytest.skip("no Chromium found; on Debian: apt-get install chromium")
    return Chromium(**options)


@pytest.fixture(scope="session")
def browser():
    with start() as browser:
        yield browser


@pytest.fixture
def chromium(browser):
    """A headless Chromium; the test is skipped, and says why, where there is none."""
    yield browser
    browser.close_pages()


@pytest.fixture
def offline_chromium():
    """The same without a network: no name resolves, no address answers."""
    with start(offline=True) as browser:
        yield browser


@pytest.fixture
def pictures():
    """The folder for screenshots, $SHELDRAKE_PICTURES; None where nobody wants any, and then none are taken."""
    folder = os.environ.get("SHELDRAKE_PICTURES")
    return Path(folder) if folder else None
