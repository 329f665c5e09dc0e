"""What the simulator says of itself on `/diagnostics`."""

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from sim_node.simulation import Simulation


def status_from_simulation(
    name: str, simulation: Simulation, n_refused: int, n_ticks: int,
) -> DiagnosticStatus:
    """
    Say how the robot and its world are.

    Parameters
    ----------
    name : str
        Of the node, with its namespace.
    simulation : Simulation
    n_refused : int
        Messages.
    n_ticks : int

    """
    touches = simulation.in_contact
    values = {'world': simulation.world.name, 'contact': str(touches).lower(),
              'collisions': simulation.n_collisions,
              'ran_into_movers': simulation.n_robot_contacts,
              'run_into_by_movers': simulation.n_mover_contacts, 'refused': n_refused,
              'stale': str(simulation.is_stale).lower(), 'ticks': n_ticks}
    return DiagnosticStatus(
        level=DiagnosticStatus.ERROR if touches else DiagnosticStatus.OK,
        name=f'{name.lstrip("/")}: robot',
        message='the robot touches something' if touches else 'all well',
        hardware_id='simulated robot',
        values=[KeyValue(key=key, value=str(value)) for key, value in values.items()])
