"""Build recipe for colcon (ament_python) and for pip."""

from pathlib import Path

from setuptools import find_packages, setup

PACKAGE = 'experience_controller'
NODES = (
    'sim_node', 'control_field_node', 'learner_node', 'teleop_node', 'neighbourhood_node',
    'localised_odometry_node', 'page_node')
DATA = ['launch', 'config', 'config/movers', 'config/robots', 'config/settings',
        'config/worlds']


def data_files():
    """Return what goes to share/: the package's marker, launch files, parameters, worlds."""
    share = f'share/{PACKAGE}'
    return [
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (share, ['package.xml']),
        *((f'{share}/{folder}', files_in(folder)) for folder in DATA),
    ]


def files_in(folder):
    """Return the files right in a folder."""
    return sorted(str(path) for path in Path(folder).iterdir() if path.is_file())


setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['benchmarks', 'test*', 'tools*']),
    # What browsers load: no packages, and no Python.
    package_data={'page_node': ['static/**/*', 'static/*']},
    data_files=data_files(),
    install_requires=['setuptools'],
    # colcon runs pytest only if this says so.
    extras_require={'test': ['pytest'], 'foxglove': ['foxglove-sdk>=0.30']},
    python_requires='>=3.11',
    zip_safe=False,
    maintainer='experience_controller maintainers',
    maintainer_email='maintainers@example.org',
    description='Learning from demonstration with a control field that experience refines.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'experience = experience_cli.main:main',
            *(f'{name} = experience_cli.executables:{name}' for name in NODES),
        ],
    },
)
