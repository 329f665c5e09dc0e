"""package.xml: format 3, in step with setup.py, the changelog and what the code imports."""

from importlib.metadata import distribution
import re
import xml.etree.ElementTree as ET

import pytest

from ros_helpers import ROOT
from tools.check_dependencies import declared_in, main


@pytest.fixture
def package():
    return ET.parse(ROOT / 'package.xml').getroot()


def test_every_import_is_declared_with_a_real_key(capsys):
    assert main() == 0, capsys.readouterr().out


def test_it_is_an_ament_python_package_of_format_3(package):
    assert package.get('format') == '3'
    assert package.findtext('export/build_type') == 'ament_python'
    assert {'name', 'version', 'description', 'maintainer', 'license', 'url'} <= {
        element.tag for element in package}


def test_no_dependency_is_declared_twice(package):
    run, test = declared_in((ROOT / 'package.xml').read_text())
    assert not run & test
    assert len(run | test) == sum(element.tag.endswith('depend') for element in package)


def test_it_agrees_with_setup_py(package):
    metadata = distribution('experience_controller').metadata
    assert package.findtext('name') == metadata['Name']
    assert package.findtext('version') == metadata['Version']
    assert package.findtext('license') == metadata['License']
    assert package.find('maintainer').get('email') == metadata['Maintainer-email']


def test_the_changelog_tells_of_this_version(package):
    """REP-132: a version, perhaps its date, underlined; or what is forthcoming."""
    text = (ROOT / 'CHANGELOG.rst').read_text()
    heads = re.findall(r'^(Forthcoming|\d+\.\d+\.\d+(?: \(\d{4}-\d\d-\d\d\))?)\n-+$', text, re.M)
    assert heads[0] == 'Forthcoming' or heads[0].startswith(package.findtext('version'))


def test_the_licence_is_the_one_named():
    text = (ROOT / 'LICENSE').read_text()
    assert 'Apache License' in text
    assert 'Version 2.0, January 2004' in text
    assert len(text.splitlines()) > 200
