"""The extra public logs: origin and hash of each file.

The files are not part of the project. To add one, clone its repository and run

    git show COMMIT:PATH > FOLDER/FILE

or fetch `ExtraFile.address`; ``python -m studies.real_axes --extra FOLDER`` then reads them.
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, kw_only=True)
class ExtraFile:
    """One public file."""

    file: str  #: Path in the folder of extra logs.
    #: The GitHub repository, its commit and the path in it.
    repository: str
    commit: str
    path: str
    sha256: str  #: Hash of the bytes.

    @property
    def address(self) -> str:
        """Address of the raw file."""
        return f"https://raw.githubusercontent.com/{self.repository}/{self.commit}/{self.path}"


def checked(folder: Path, file: str) -> Path | None:
    """Return the path of an extra file, or None if it is absent.

    Raises
    ------
    ValueError
        If the file is another one.
    """
    path = folder / file
    if not path.is_file():
        return None
    if hashlib.sha256(path.read_bytes()).hexdigest() != EXTRA_FILES[file].sha256:
        raise ValueError(f"{path} has another hash than {EXTRA_FILES[file].address}")
    return path


_ORIGINS: tuple[tuple[str, str, tuple[tuple[str, str, str], ...]], ...] = (
    (
        "shamilmamedov/dynamic_calibration",
        "11af40e7deb758ec080a175fed8fcdd6c99aca29",
        (
            (
                "ur10e/ur-20_01_22-joint_1.csv",
                "dataset_ur10e/jointwise_motion/ur-20_01_22-joint_1.csv",
                "29cbb22afa01aae4a7e2fedaf63d6df90ef98decb1ec74a9b4863d2bc4d5eda0",
            ),
            (
                "ur10e/ur-20_01_22-joint_2.csv",
                "dataset_ur10e/jointwise_motion/ur-20_01_22-joint_2.csv",
                "50d969ecc38b1cd6916f0b38b63b4f5e65739319543637add44aa086fb3a8370",
            ),
            (
                "ur10e/ur-20_01_22-joint_3.csv",
                "dataset_ur10e/jointwise_motion/ur-20_01_22-joint_3.csv",
                "a012487f8bedac5d6baf86c17fe4cbbf2b8f12a31070974da5867cf927e3a0a7",
            ),
            (
                "ur10e/ur-20_01_22-joint_5.csv",
                "dataset_ur10e/jointwise_motion/ur-20_01_22-joint_5.csv",
                "c0becd691c44d0e46e9fe70bd00e403d12e48f53caf8def9fb072e705f1a5b80",
            ),
        ),
    ),
    (
        "karthikurs/actuator-dynamometer",
        "1ab6e56f6f9dbedd90398ccdfc05a4728ed38e03",
        (
            (
                "moteus/futek_test_06_05_2021_14-28-13.csv",
                "futek_data/futek_test_06_05_2021_14-28-13.csv",
                "42455453683eafbce5e5a16dc0198f8ced6a59f22c9f8ac2a95aa426a70db0c4",
            ),
            (
                "moteus/futek_test_06_05_2021_14-23-18.csv",
                "futek_data/futek_test_06_05_2021_14-23-18.csv",
                "1997264ba2c729e38dc4e135603653f97502a82a8d0baa4af94daf078b9a8f70",
            ),
            (
                "moteus/futek_test_06_05_2021_17-09-17.csv",
                "futek_data/futek_test_06_05_2021_17-09-17.csv",
                "6290e6e81e744e6250a85651c5f1794503830b76881c4c7ad3b79620f85b2ff7",
            ),
            (
                "moteus/futek_test_06_05_2021_14-07-32.csv",
                "futek_data/futek_test_06_05_2021_14-07-32.csv",
                "75180ec2f673e1960369f01b2918b7a1434f1a961e7e64f97289ce2bcb54e1c2",
            ),
            (
                "moteus/futek_test_06_05_2021_17-22-41.csv",
                "futek_data/futek_test_06_05_2021_17-22-41.csv",
                "9500f41ca9e55e57868e8733bfec64df2e1910b825c3ca32a6c052cd004b2ab7",
            ),
            (
                "moteus/futek_test_27_04_2021_17-39-20.csv",
                "futek_data/futek_test_27_04_2021_17-39-20.csv",
                "8ce9f5d8037a23afa36ddfad64e862f92c388de18ebcaa440082c3e8578a2dda",
            ),
            (
                "moteus/futek_test_27_04_2021_17-52-10.csv",
                "futek_data/futek_test_27_04_2021_17-52-10.csv",
                "99b78ed155bd6b73e683b7bd4f6c2bac2843cceb6f44c0a94fe3b233eb88f893",
            ),
            (
                "moteus/futek_test_25_05_2021_16-14-40.csv",
                "futek_data/futek_test_25_05_2021_16-14-40.csv",
                "c500eb619b70db5a16001b7c897f796d259490f5d97e3c551a53f863142c7ef3",
            ),
            (
                "moteus/futek_test_25_05_2021_16-24-02.csv",
                "futek_data/futek_test_25_05_2021_16-24-02.csv",
                "43839902819f8aae84694f3b530ea747690bc5a7ecf8c591b004d84a7152fbc1",
            ),
            (
                "moteus/futek_test_05_05_2021_17-35-01.csv",
                "futek_data/futek_test_05_05_2021_17-35-01.csv",
                "2495308748b1a8282ed338d3a7b325abcd3882f629ddeb970773c1eed2ca94b7",
            ),
            (
                "moteus/futek_test_06_05_2021_14-11-02.csv",
                "futek_data/futek_test_06_05_2021_14-11-02.csv",
                "65b871e6c03d743fd0b5332c7dc5c5aa77615c12d99fe6fec166ede4986a2006",
            ),
            (
                "moteus/futek_test_06_05_2021_14-21-05.csv",
                "futek_data/futek_test_06_05_2021_14-21-05.csv",
                "3255ea4ded13db2b7fa2069aa091a07904a7e92024504a65cc5b609172989a58",
            ),
            (
                "moteus/futek_test_13_05_2021_17-55-58.csv",
                "futek_data/futek_test_13_05_2021_17-55-58.csv",
                "a05bc177d1d23b4f763413eb590b8a83eb1dedd826c13c0f4ff836c4b35b5cdc",
            ),
        ),
    ),
    (
        "YIZHIXIAOCANGSHU/Friction-Identification-for-Manipulators",
        "f915751262ab6c43dc436b7395f41b03f2e8ee2b",
        (
            (
                "openarm/real_friction_identification_joint_1.npz",
                "results/real_friction_identification_joint_1.npz",
                "1c4bbf9c7522ef7538e737d37b153ea1b43482a3790338c842f8eb4915c413fc",
            ),
            (
                "openarm/real_friction_identification_joint_2.npz",
                "results/real_friction_identification_joint_2.npz",
                "cb7bb454eebbb6ff656ced1498203ecb6fd685ddb5790c3df98645ef5863c0e9",
            ),
            (
                "openarm/real_friction_identification_joint_4.npz",
                "results/real_friction_identification_joint_4.npz",
                "72adf26174e8e9482c7efb3f6024d5126974502f386dffb503e2d6bab433da79",
            ),
            (
                "openarm/real_friction_identification_joint_5.npz",
                "results/real_friction_identification_joint_5.npz",
                "90da829a62fe226aec091850a17faecc487612abf75e57be7e52a4449fc09bec",
            ),
            (
                "openarm/real_friction_identification_joint_6.npz",
                "results/real_friction_identification_joint_6.npz",
                "143dc9e249dcd87beac8316b3470c1afef3c9a8e34b1d8db769710639d041dda",
            ),
            (
                "openarm/real_friction_identification_joint_7.npz",
                "results/real_friction_identification_joint_7.npz",
                "58fafdcfbea185125f8b069302fe44218d7c17611d7d48a8fdcdfda9cad78436",
            ),
        ),
    ),
    (
        "TeacherRock/Lorenz_Friction",
        "105c789fca1d93a90663f0ee06acc65344856118",
        (
            (
                "lorenz/data_S3_5.txt",
                "Lorenz_id/Lorenz_id/data/data_S3_5.txt",
                "2a3dc441361df536ca7e7426e90ff72d154e62aa2cf149e87a5e06b65d32dcef",
            ),
            (
                "lorenz/data_S3_6.txt",
                "Lorenz_id/Lorenz_id/data/data_S3_6.txt",
                "adea1cf0d531dc94023e8552c468c98cfeddf0eb08ce38bd861c58cd1db351d5",
            ),
            (
                "lorenz/data_S3_7.txt",
                "Lorenz_id/Lorenz_id/data/data_S3_7.txt",
                "13c50330822afa2685c7e387f74b7a9312ab17aca0caf27975b85df010b453ed",
            ),
            (
                "lorenz/data_S3_8.txt",
                "Lorenz_id/Lorenz_id/data/data_S3_8.txt",
                "fca3f4597b4d7055185eaba6ae5e19b3cb8d015f184d415a6c95a612eebd1473",
            ),
            (
                "lorenz/data_S3_9.txt",
                "Lorenz_id/Lorenz_id/data/data_S3_9.txt",
                "0256b7d76730b1ac08abadc5b32090eeb474928ec905380572532f8a8b7c64ad",
            ),
            (
                "lorenz/data_S3_10.txt",
                "Lorenz_id/Lorenz_id/data/data_S3_10.txt",
                "32df4ef1da9df31fab3b6ed5544934e6571ca8d3bc8614c9c46f97c8a751be1c",
            ),
            (
                "lorenz/Lorenz_Jm_1.txt",
                "data/Lorenz_Jm_1.txt",
                "ceeb277042d9a73a8149b95a2a449959d7d0d40f6fdb66e12e16253f7112bba0",
            ),
            (
                "lorenz/Lorenz_Jm_2.txt",
                "data/Lorenz_Jm_2.txt",
                "9e958b6395c25f52fe6fde773eccc3f01e69e9b2ecb0a496c86be5e66fdfb76f",
            ),
            (
                "lorenz/Lorenz_Jm_3.txt",
                "data/Lorenz_Jm_3.txt",
                "cc816627aec102c1d366c31d736b66b5f458900ed360ab360fa1b84d179799c7",
            ),
            (
                "lorenz/Lorenz_Bm_1.txt",
                "data/Lorenz_Bm_1.txt",
                "9218ae7abab019940a58b1b8c118911dbf827e07bacc9c30d2b5fa37f80b0806",
            ),
            (
                "lorenz/Lorenz_Bm_2.txt",
                "data/Lorenz_Bm_2.txt",
                "07af9388b4748152e0d4eb95207fa7ca76f384536028dfcc1daf81d35d9c5963",
            ),
            (
                "lorenz/Lorenz_Bm_3.txt",
                "data/Lorenz_Bm_3.txt",
                "862710951fefc4eaa342c6d066d63c993f85610281ccd2ce7fac6fcbf1fe8bb6",
            ),
            (
                "lorenz/Lorenz_Fc_1.txt",
                "data/Lorenz_Fc_1.txt",
                "b04fe20ee11eefda8534c8c3b30240377447cd6ed91d70df4d9085b89c7adff0",
            ),
            (
                "lorenz/Lorenz_Fc_2.txt",
                "data/Lorenz_Fc_2.txt",
                "7162d9e054a8cdaced00a017290150b61ce6c0d7882c0817e7b0388992da275c",
            ),
            (
                "lorenz/Lorenz_Fc_3.txt",
                "data/Lorenz_Fc_3.txt",
                "48d206b9cb8791236c5fd76fca45997e9d3fa15f44fc7d2e789703ae55fb078c",
            ),
            (
                "lorenz/Lorenz_Fs_1.txt",
                "data/Lorenz_Fs_1.txt",
                "3254eb7abac0d692d388fa179b67c4479693e5100ac10ce63bc92dac544818d6",
            ),
        ),
    ),
    (
        "nielsSkov/masterThesisMatlab",
        "0e2c7253fe6e740c36da872508a71c0d1f66a965",
        (
            (
                "cart/cartTest1_testOffPointTwo.csv",
                "parameterEstimation/data/cartTest1/testOffPointTwo.csv",
                "8ecaf801ca4e5999900af34ec557ab4b24704d0d0c6cc9942184c0322d2a51bf",
            ),
            (
                "cart/cartTest1_testOffPointThree.csv",
                "parameterEstimation/data/cartTest1/testOffPointThree.csv",
                "44b4fdf0e494a2ca372dc5b0b86f2daa00bea08b5979c43d7a5f710077e3e021",
            ),
            (
                "cart/cartTest1_testOffPointFour.csv",
                "parameterEstimation/data/cartTest1/testOffPointFour.csv",
                "1d75df82b4387f978028759f355e0c9644170c5549a1c69b921e73038805ada4",
            ),
            (
                "cart/cartTest1_testOffPointFive.csv",
                "parameterEstimation/data/cartTest1/testOffPointFive.csv",
                "536be3a28625760628fbd7721adedd2b433f4290044b3ffdec1c34722cfcc370",
            ),
            (
                "cart/cartTest1_testOffPointSix.csv",
                "parameterEstimation/data/cartTest1/testOffPointSix.csv",
                "8d3a86209bcbdf1e065388ca4b5fcfea43d1b6c245137c9803d495582c34da41",
            ),
            (
                "cart/cartTest2_0m10.csv",
                "parameterEstimation/data/cartTest2/0m10.csv",
                "bada49eae6021f75837f2a2d9716ac533e622bd255184374f9602fdca357a661",
            ),
            (
                "cart/cartTest2_0m40.csv",
                "parameterEstimation/data/cartTest2/0m40.csv",
                "caf8bc3a02cb2116951bb294ddf83d4428d62e8ac324b952b829531ea9713dfc",
            ),
            (
                "cart/cartTest2_0m72.csv",
                "parameterEstimation/data/cartTest2/0m72.csv",
                "aed573ff4ff37fa8335804d4dd96a4fcc309a7b59759418b185ed0d1fc9f34e4",
            ),
            (
                "cart/cartTest3_0m10.csv",
                "parameterEstimation/data/cartTest3/0m10.csv",
                "305556de02afe2ff614a70c5a6350f62631b047db04805c46b0d99f95feeb4dc",
            ),
            (
                "cart/cartTest3_0m40.csv",
                "parameterEstimation/data/cartTest3/0m40.csv",
                "cc7c392de7218ed360efd4cf5ce9ff0c94a43de3db42a32f1dcc4f61f00f009c",
            ),
            (
                "cart/cartTest3_0m72.csv",
                "parameterEstimation/data/cartTest3/0m72.csv",
                "a97257e14e555f57dcc63979ecd3e6388ab1d74c0cb841d21569dd2e87021733",
            ),
        ),
    ),
    (
        "nicolazande/camber-control",
        "cb9a8f826d67bc8f363c2028ee0eb2f384af3b26",
        (
            (
                "camber/EccA_load-square-wave-full-travel-1Hz.txt",
                "actuators/EccA/data/load-square-wave-full-travel-1Hz.txt",
                "ca83dd1c1f9e84b596287960d7c0a1bc57459d70000c07d356cf174763c772b5",
            ),
            (
                "camber/LinA_no-pp-sine-sweep-10mm-0.5Hz.txt",
                "actuators/LinA/data/no-pp-sine-sweep-10mm-0.5Hz.txt",
                "68b703d4deca3ed091fb667cb0c52a2ae4ef5513b7c7cf304e0110139bd202aa",
            ),
            (
                "camber/LinA_pp-sine-sweep-10mm-0.5Hz.txt",
                "actuators/LinA/data/pp-sine-sweep-10mm-0.5Hz.txt",
                "c0080803529fb32bdc2aa209af6147647c1b6915fd3b87c1ef2fbdac4c451965",
            ),
            (
                "camber/LinB_no-load-square-wave-full-travel-2Hz.txt",
                "actuators/LinB/data/no-load-square-wave-full-travel-2Hz.txt",
                "66ff121a6fb948c09937090b5a4d5f1530143dc742bd0f5ff798c04286e4e02f",
            ),
            (
                "camber/LinD_no-pp-sine-sweep-10mm-0.5Hz.txt",
                "actuators/LinD/data/no-pp-sine-sweep-10mm-0.5Hz.txt",
                "880408135e04fce0e057f524729b38f657dc29364f58e2688f1e37b740b69f2a",
            ),
        ),
    ),
    (
        "marcocognetti/FrankaEmikaPandaDynModel",
        "24d85ce4e648e2e894c832bfeee9b16711eb1a1a",
        (
            (
                "panda/exciting_traj_time.txt",
                "matlab/data/Exciting_Traj/Trajectory_1/rbt_log/exciting_traj_time.txt",
                "031063612f297011dc005ab29830903e36f4bfeba77bce59c0fbde13620fb20d",
            ),
            (
                "panda/exciting_traj_positions.txt",
                "matlab/data/Exciting_Traj/Trajectory_1/rbt_log/exciting_traj_positions.txt",
                "50bf82a082c439aff8220e8142985c8dd783f7ddc1415987cd75c9efb88bcf69",
            ),
            (
                "panda/exciting_traj_velocity.txt",
                "matlab/data/Exciting_Traj/Trajectory_1/rbt_log/exciting_traj_velocity.txt",
                "3340f299e926c501b66d540fa461ea0a7184b8dda32e505ebed062db57860d49",
            ),
            (
                "panda/exciting_traj_torques.txt",
                "matlab/data/Exciting_Traj/Trajectory_1/rbt_log/exciting_traj_torques.txt",
                "11fda32785bb29ce444e14e0f45f4893aab7142dc6ee29576d828ab154852f9c",
            ),
        ),
    ),
)

EXTRA_FILES = {
    file: ExtraFile(file=file, repository=repository, commit=commit, path=path, sha256=digest)
    for repository, commit, files in _ORIGINS
    for file, path, digest in files
}
"""Every extra file, by its place in the folder."""
