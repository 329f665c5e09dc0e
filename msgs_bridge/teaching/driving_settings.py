"""What settings of whatever a person drives with have in common."""

from control_field.robot.limits import Velocity


class DrivingSettings:
    """Base of the settings of keys and page, which declare these each with its own words."""

    enable_stamped_cmd_vel: bool
    lockstep: bool
    speed: float
    turn: float
    speed_max: float
    turn_max: float

    def check_driving(self, *names: str) -> None:
        """
        Check that these settings name something, and that the speeds are not too great.

        Raises
        ------
        ValueError
            If that is not so; the message names the setting.

        """
        for name in names:
            if not getattr(self, name).strip():
                raise ValueError(f'{name} is empty, must be a name')
        for name, most in (('speed', self.speed_max), ('turn', self.turn_max)):
            if getattr(self, name) > most:
                raise ValueError(f'{name} is {getattr(self, name)}, must be at most {name}_max, '
                                 f'which is {most}')

    @property
    def is_stamped(self) -> bool:
        """Whether commands are TwistStamped."""
        return self.lockstep or self.enable_stamped_cmd_vel

    @property
    def speeds(self) -> Velocity:
        """Return forward speed [m/s] and turning rate [rad/s] of a key, or of a full push."""
        return self.speed, self.turn

    @property
    def greatest(self) -> Velocity:
        """Return the greatest of both."""
        return self.speed_max, self.turn_max
